"""Closed curves tracked round after round: largest joint steps and drift."""

from ...harness.experiment import Experiment

# What a record is about: one round of a curve, or three.
CURVE, DRIFT = "curve", "drift"
# How the frames of a curve are solved.
COLD, WARM, COHERENT = "cold", "warm", "coherent"

EXPERIMENT = Experiment(
    __package__, "tracking",
    "closed curves: frames from rest, from the last solution, and coherently",
)  # fmt: skip
