"""Timing by pytest-benchmark: forward kinematics, solves and steps, in one file a subject."""
