"""The lab's arm: curves drawn by its effector, and targets out of reach."""

# The tasks of records.
CURVE, BEYOND = "curve", "beyond"
