"""What the report shows of large cloths."""

from ...presentation.entry import Entry
from . import tables

ENTRIES = (
    Entry("Iterations, up to a million particles", tables.iterations),
    Entry("Factors, up to a million particles", tables.factors),
)
