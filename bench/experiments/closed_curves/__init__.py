"""Tracking of closed curves: how far joints rotate between frames, and drift over repetitions."""

from ...harness.experiment import Experiment

# What a record is about: a curve followed once, or three times.
CURVE, DRIFT = "curve", "drift"
# How the frames of a curve are solved.
COLD, WARM, COHERENT = "cold", "warm", "coherent"

EXPERIMENT = Experiment(
    __package__,
    suite="tracking",
    chapter="kinematics",
    about="closed curves: frames from rest, from the last solution, and coherently",
)
