"""What the report shows of the lab's cloth."""

from ...presentation.entry import Entry
from ..pictures import figures as pictures
from . import figures, tables

ENTRIES = (
    Entry(
        "How far is one solve of Q x = b from the step it stands for?",
        tables.few_iterations,
        (pictures.falling_cloth,),
    ),
    Entry(
        "How fast do local/global and Newton converge?",
        tables.convergence,
        (figures.cloth_convergence,),
    ),
    Entry("Does Newton always get there?", tables.newton_steps),
    Entry("How far apart are the two laws of dampers?", tables.dampers),
)
