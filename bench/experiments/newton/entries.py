"""What the report shows of certified steps."""

from ...presentation.entry import Entry
from . import tables

ENTRIES = (Entry("Which answers to a hard step are proven?", tables.certified),)
