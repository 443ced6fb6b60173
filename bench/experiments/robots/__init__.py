"""Robots and characters: every installed inverse-kinematics solver on the same targets."""

# The tasks of records: targets within a robot's reach, or out of reach.
REACHABLE, UNREACHABLE = "reachable", "unreachable"
# A solver with a time limit, whose answers differ from run to run, solves all targets so often.
REPEATS = 3
