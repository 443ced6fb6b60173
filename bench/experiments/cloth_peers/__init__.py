"""One cloth for every engine: work against precision, stability."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(__package__, "cloth")
