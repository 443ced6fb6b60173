"""One step of a heavy cloth by every solver, and what is proven of it."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="newton",
    chapter="cloth",
    about="one step of a heavy cloth by every solver: how far from a minimiser, proven",
)
