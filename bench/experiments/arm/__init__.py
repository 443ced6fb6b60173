"""The lab's arm: curves drawn by its effector, and targets out of reach."""

# What a record is about.
CURVE, BEYOND = "curve", "beyond"
