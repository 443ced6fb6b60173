"""What the report shows of the lab's first two questions about inverse kinematics."""

from ...presentation.entry import Entry
from . import figures, tables

ENTRIES = (
    Entry(
        "Q1. If the target is too far away, what does inverse kinematics give?",
        tables.beyond_reach,
    ),
    Entry(
        "Q2. How many iterations do CCD and FABRIK need?", tables.iterations, (figures.iterations,)
    ),
)
