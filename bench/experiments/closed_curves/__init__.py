"""Tracking of closed curves: how far joints rotate between frames, and drift over repetitions."""

# The tasks of records: a curve followed once, or three times.
CURVE, DRIFT = "curve", "drift"
# The modes in which the frames of a curve are solved.
COLD, WARM, NEAREST = "cold", "warm", "nearest"
