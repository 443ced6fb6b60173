"""The poses and cloths that the report draws."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(__package__, "pictures", "the poses and cloths that the report draws")
