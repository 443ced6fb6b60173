"""Published tables measured again in their own set-up."""

from ...harness.experiment import Experiment

# What a record is about.
TRAC_IK, TOOLBOX, FABRIK = "TRAC-IK’s table", "the toolbox’s table", "FABRIK’s table"

EXPERIMENT = Experiment(__package__, suite="ik", chapter="robots")
