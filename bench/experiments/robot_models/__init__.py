"""Robots and characters from files of others, read by both engines."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="robot_models",
    chapter="right",
    about="robots and characters from files of others, beside both engines",
)
