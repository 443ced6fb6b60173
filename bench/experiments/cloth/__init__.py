"""The lab's cloth at three stiffnesses: convergence of every step solver."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__, "cloth",
    "the lab's cloth at three stiffnesses: convergence; one cloth for every solver",
)  # fmt: skip
