"""The lab's arm: curves drawn by its effector, and targets out of reach."""

from ...harness.experiment import Experiment

# What a record is about.
CURVE, BEYOND = "curve", "beyond"

EXPERIMENT = Experiment(
    __package__,
    suite="arm",
    chapter="kinematics",
    about="the lab's arm on every curve, and reaching for what is too far",
)
