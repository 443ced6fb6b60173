"""Cloths of a thousand particles and more: factorisations, solves, memory."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(
    __package__, "cloth_scale",
    "cloths of a thousand particles and more: factors, solves, memory",
)  # fmt: skip
