"""What the report shows of first calls."""

from ...presentation.entry import Entry
from . import tables

ENTRIES = (Entry("What does the first call cost, which compiles?", tables.first_calls),)
