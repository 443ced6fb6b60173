"""What the report shows of the cross-check."""

from ...presentation.entry import Entry
from . import tables

ENTRIES = (Entry("Do Pinocchio and MuJoCo agree with the reference?", tables.verdicts),)
