"""A chain of ten ball joints: accuracy and iterations of every inverse-kinematics solver."""

from ...harness.experiment import Experiment

# What a record is about, and the stratum of targets out of reach.
CHAIN, BEYOND = "chain", "beyond"

EXPERIMENT = Experiment(
    __package__,
    suite="ik",
    chapter="kinematics",
    about="a chain of ten ball joints, robots and a character, beside every solver installed",
)
