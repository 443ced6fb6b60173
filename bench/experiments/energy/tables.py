"""What integrators do to the energy of a swinging cloth."""

from collections.abc import Sequence
from functools import partial

from ...harness import metrics
from ...harness.record import Record
from ...presentation.columns import lengths_of_steps, text, titled
from ...presentation.entry import Entry
from ...presentation.results import Results, label, settings
from ...presentation.tables import Column, Summary, Table, in_unit, tabulate, words
from . import figures

LISTED = (100, 1_000, 10_000)


def energy(results: Results) -> Table:
    """Return how much of the energy every integrator leaves, without dampers and with."""
    records = results.all("energy")
    return tabulate(
        "energy",
        "Energy of a swinging cloth",
        (
            titled("cloth"),
            text("integrator", lambda record: label(record.solver)),
            *(
                Column(f"left after {words(k)} steps", "%", read=partial(_left, steps=k))
                for k in LISTED
            ),
            Column("most ever", "%", read=lambda record: _extent(record)[1]),
            Column("least ever", "%", read=lambda record: _extent(record)[0]),
        ),
        records,
        shows="Energy of motion, springs and gravity above that of the cloth at rest, in percent "
        "of the start. Without dampers all of it should stay. implicit, implicitfast, discrete "
        "and RK4 are MuJoCo’s: discrete is one Gauss-Newton step of implicit Euler, and without "
        "dampers implicit and implicitfast are symplectic Euler, step for step.",
        measured="The lab’s cloth of 5 × 5 particles let go from rest, with its damping of 0.2 "
        f"N s/m and without; {settings(records, 'steps')} steps of {lengths_of_steps(records)} ms, "
        f"of which every {settings(records, 'every')}th is looked at. Implicit Euler by "
        f"local/global iterations to a residual of {settings(records, 'tolerance')}.",
        summary=_summary,
    )


def _extent(record: Record) -> tuple[float, float]:
    return metrics.extent(record.arrays["left"])


def _left(record: Record, steps: int) -> float | None:
    k = steps // record.settings["every"]
    left = record.arrays["left"]
    return float(left[k]) if k < left.size else None


def _summary(records: Sequence[Record]) -> Summary:
    undamped = [record for record in records if record.facts["damping"] == 0.0]
    if not undamped:
        return Summary()
    return Summary(
        f"Without dampers all energy should stay. After {settings(undamped, 'steps')} steps there "
        "is left, in percent:",
        tuple(f"{label(record.solver)}: {_range(record)}" for record in undamped),
    )


def _range(record: Record) -> str:
    shares = (float(record.arrays["left"][-1]), *_extent(record))
    last, low, high = (words(in_unit(share, "%")) for share in shares)
    return f"{last}, never less than {low} nor more than {high}"


ENTRIES = (Entry("What happens to the energy over many steps?", energy, (figures.energy,)),)
