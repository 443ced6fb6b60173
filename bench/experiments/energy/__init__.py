"""The energy of a swinging cloth under six integrators."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="energy",
    chapter="cloth",
    about="what integrators do to the energy of a cloth over 10,000 steps",
)
