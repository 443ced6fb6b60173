"""What the report shows of the lab's third question about inverse kinematics."""

from ...presentation.entry import Entry
from ..arm import figures as arm
from . import tables

ENTRIES = (
    Entry(
        "Q3. Joints may jitter from frame to frame: how is it avoided?",
        tables.jitter,
        (arm.jitter,),
    ),
    Entry("What does a smooth motion cost?", tables.price),
    Entry("Does a motion drift as it is repeated?", tables.drift),
)
