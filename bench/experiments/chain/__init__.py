"""A chain of ten ball joints: accuracy and iterations of every inverse-kinematics solver."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__, "ik",
    "a chain of ten ball joints, robots and a character, beside every solver installed",
)  # fmt: skip
