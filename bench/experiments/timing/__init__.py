"""Timing of forward kinematics, solves and steps, in one file a subject."""
