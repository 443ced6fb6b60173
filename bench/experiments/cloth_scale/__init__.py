"""Cloths of a thousand particles and more: factorisations, solves, memory."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="cloth_scale",
    chapter="speed",
    about="cloths of a thousand particles and more: factors, solves, memory",
)
