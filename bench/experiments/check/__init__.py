"""The reference against both engines: verdicts, and any files of the user's."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__,
    suite="check",
    chapter="right",
    about="the reference against Pinocchio and MuJoCo, claim by claim",
)
