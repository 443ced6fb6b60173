"""What the report shows of accuracy within reach."""

from ...presentation.entry import Entry
from ..chain import figures as chain
from . import tables

ENTRIES = (
    Entry("How often, and how closely, is the target met?", tables.accuracy, (chain.ik_residuals,)),
)
