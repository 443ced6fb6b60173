"""What the report shows of published tables."""

from ...presentation.entry import Entry
from . import tables

ENTRIES = (
    Entry("What did TRAC-IK’s authors measure, and what do we?", tables.trac_ik),
    Entry("And those of the Robotics Toolbox?", tables.toolbox),
    Entry("And those of FABRIK?", tables.fabrik),
)
