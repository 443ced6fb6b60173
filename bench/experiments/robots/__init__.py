"""Robots and characters: every installed inverse-kinematics solver on the same targets."""
