"""Timing by pytest-benchmark: forward kinematics, solves and steps, in one file a subject."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="timing",
    chapter="speed",
    about="forward kinematics, solves and steps beside both engines",
)
