"""Published tables measured again in their own set-up."""

from ...harness.experiment import Experiment

EXPERIMENT = Experiment(__package__, "ik")
