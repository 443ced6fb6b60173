"""What the report shows of the custom curve."""

from ...presentation.entry import Entry
from . import figures, tables

ENTRIES = (
    Entry("What does resampling the custom curve change?", tables.resampling, (figures.arm_draws,)),
)
