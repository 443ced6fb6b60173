"""The poses and cloths that the report draws."""

from ...harness.experiment import Experiment

# What a record is about.
ARM, CLOTH = "arm", "cloth"

EXPERIMENT = Experiment(
    __package__,
    suite="pictures",
    chapter="kinematics",
    about="the poses and cloths that the report draws",
)
