"""What the report shows of one cloth for every solver."""

from ...presentation.entry import Entry
from . import figures, tables

ENTRIES = (
    Entry("How many iterations does an error of 1e-8 take?", tables.iterations),
    Entry(
        "Which of all solvers is soonest near the converged step?",
        tables.one_step,
        (figures.one_step,),
    ),
    Entry(
        "And frame after frame, near implicit Euler and near the truth?",
        tables.motion,
        (figures.to_implicit_euler, figures.to_the_truth),
    ),
    Entry("How long may the steps of explicit solvers be?", tables.stability),
    Entry("What did Liu et al. (2013) measure, and what do we?", tables.liu_2013),
)
