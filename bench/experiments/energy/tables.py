"""What integrators do to the energy of a swinging cloth."""

from collections.abc import Sequence
from functools import partial

from ...harness.record import Record
from ...tables.columns import at, lengths_of_steps, text, titled
from ...tables.layout import Layout
from ...tables.results import label, settings
from ...tables.table import Column, Summary, in_unit, words
from . import DAMPINGS, SIZE, figures, readings

LISTED = (100, 1_000, 10_000)


def _summary(records: Sequence[Record]) -> Summary:
    undamped = [record for record in records if record.details.damping == 0.0]
    if not undamped:
        return Summary()
    return Summary(
        f"Without dampers all energy should stay. After {settings(undamped, 'steps')} steps there "
        "is left, in percent:",
        tuple(f"{label(record.solver)}: {_range(record)}" for record in undamped),
    )


def _range(record: Record) -> str:
    shares = float(record.values.left[-1]), *readings.extent(record)
    last, low, high = (words(in_unit(share, "%")) for share in shares)
    return f"{last}, never less than {low} nor more than {high}"


energy = Layout(
    "What happens to the energy over many steps?",
    "energy",
    "Energy of a swinging cloth",
    subjects=lambda results: results.all("energy"),
    columns=(
        titled("cloth"),
        text("integrator", lambda record: label(record.solver)),
        *(
            Column(
                f"left after {words(k)} steps",
                "%",
                read=partial(readings.left_after, steps=k),
                group="left after",
            )
            for k in LISTED
        ),
        Column("greatest", "%", read=at(1, readings.extent)),
        Column("least", "%", read=at(0, readings.extent)),
    ),
    shows="Energy of motion, springs and gravity above that of the cloth at rest, in percent "
    "of the start. Without dampers all of it should stay. implicit, implicitfast, discrete "
    "and RK4 are MuJoCo’s: discrete is one Gauss-Newton step of implicit Euler, and without "
    "dampers implicit and implicitfast are symplectic Euler, step for step.",
    measured=lambda records: (
        f"The lab’s cloth of {SIZE} × {SIZE} particles let go from rest, with its damping of "
        f"{DAMPINGS['damped']:g} N s/m and without; {settings(records, 'steps')} steps of "
        f"{lengths_of_steps(records)} ms, of which every {settings(records, 'every')}th is looked "
        "at. Implicit Euler by local/global iterations to a residual of "
        f"{settings(records, 'tolerance')}."
    ),
    summary=_summary,
    figures=(figures.energy,),
)


LAYOUTS = (energy,)
