"""What the report shows of robots and characters from files."""

from ...presentation.entry import Entry
from . import tables

ENTRIES = (Entry("On which robots and characters do they agree?", tables.agreement),)
