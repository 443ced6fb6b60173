"""Robots and characters: every installed inverse-kinematics solver on the same targets."""

# What a record is about: targets within reach of a robot, or out of it.
REACHABLE, UNREACHABLE = "reachable", "unreachable"
