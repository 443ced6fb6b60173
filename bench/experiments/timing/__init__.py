"""Timing of forward kinematics, solves and steps, a file for each subject."""
