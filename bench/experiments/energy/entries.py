"""What the report shows of the energy of integrators."""

from ...presentation.entry import Entry
from . import figures, tables

ENTRIES = (Entry("What happens to the energy over many steps?", tables.energy, (figures.energy,)),)
