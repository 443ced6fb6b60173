"""Robots and characters from files of others, read by both engines."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__, "robot_models",
    "robots and characters from files of others, beside both engines",
)  # fmt: skip
