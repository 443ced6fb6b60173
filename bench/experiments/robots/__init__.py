"""Robots and characters: every installed inverse-kinematics solver on the same targets."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(__package__, "ik")
