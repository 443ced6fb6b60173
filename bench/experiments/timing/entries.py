"""What the report shows of the timing."""

from ...presentation.entry import Entry
from . import figures, tables

ENTRIES = (
    Entry("Forward kinematics", tables.kinematics, (figures.kinematics,)),
    Entry("Inverse kinematics", tables.inverse_kinematics, (figures.inverse_kinematics,)),
    Entry("A step of the cloth", tables.cloth, (figures.cloth,)),
)
