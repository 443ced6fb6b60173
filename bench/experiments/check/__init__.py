"""The reference against both engines: verdicts, and any files of the user's."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__, "check",
    "the reference against Pinocchio and MuJoCo, claim by claim",
)  # fmt: skip
