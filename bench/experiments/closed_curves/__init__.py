"""Closed curves tracked round after round: largest joint steps and drift."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__, "tracking",
    "closed curves: frames from rest, from the last solution, and coherently",
)  # fmt: skip
