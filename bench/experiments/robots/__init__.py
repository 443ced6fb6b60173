"""Robots and characters: every installed inverse-kinematics solver on the same targets."""

# What a record is about: targets within reach of a robot, or out of it.
REACHABLE, UNREACHABLE = "reachable", "unreachable"

# A limit counts as kept to this [rad]; some peers keep limits in single precision.
LIMIT_TOLERANCE = 1e-6
