"""The lab's cloth at three stiffnesses: convergence of every step solver."""

from ...harness.experiment import Experiment

# What a record is about.
SWING, ONE_STEP, FEW, DAMPERS = "swing", "one step", "few iterations", "dampers"

EXPERIMENT = Experiment(
    __package__,
    suite="cloth",
    chapter="cloth",
    about="the lab's cloth at three stiffnesses: convergence; one cloth for every solver",
)
