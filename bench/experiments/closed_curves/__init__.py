"""Tracking of closed curves: how far joints rotate between frames, and drift over repetitions."""

# What a record is about: a curve followed once, or three times.
CURVE, DRIFT = "curve", "drift"
# How the frames of a curve are solved.
COLD, WARM, COHERENT = "cold", "warm", "coherent"
