"""What integrators do to the energy of a swinging cloth."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, label, settings
from ...presentation.tables import Cell, Column, Summary, Table, words

LISTED = (100, 1_000, 10_000)


def energy(results: Results) -> Table:
    """Return how much of the energy every integrator leaves, without dampers and with."""
    records = results.all("energy")
    return Table(
        "energy",
        "Energy of a swinging cloth",
        (
            Column("cloth", words=True),
            Column("integrator", words=True),
            *(Column(f"left after {words(k)} steps", "%") for k in LISTED),
            Column("most ever", "%"),
            Column("least ever", "%"),
        ),
        tuple(_row(record) for record in records),
        shows="Energy of motion, springs and gravity above that of the cloth at rest, in percent "
        "of the start. Without dampers all of it should stay. implicit, implicitfast, discrete "
        "and RK4 are MuJoCo’s: discrete is one Gauss-Newton step of implicit Euler, and without "
        "dampers implicit and implicitfast are symplectic Euler, step for step.",
        measured="The lab’s cloth of 5 × 5 particles let go from rest, with its damping of 0.2 "
        f"N s/m and without; {settings(records, 'steps')} steps of {_milliseconds(records)} ms, "
        f"of which every {settings(records, 'every')}th is looked at. Implicit Euler by "
        f"local/global iterations to a residual of {settings(records, 'tolerance')}.",
        summary=_summary(records),
    )


def _row(record: Record) -> tuple[Cell, ...]:
    low, high = metrics.extent(record.arrays["left"])
    return (
        record.title,
        label(record.solver),
        *(_left(record, k) for k in LISTED),
        metrics.percent(high, 1.0),
        metrics.percent(low, 1.0),
    )


def _left(record: Record, steps: int) -> float | None:
    k = steps // record.settings["every"]
    left = record.arrays["left"]
    return metrics.percent(float(left[k]), 1.0) if k < left.size else None


def _summary(records: Sequence[Record]) -> Summary:
    undamped = [record for record in records if record.facts["damping"] == 0.0]
    if not undamped:
        return Summary()
    return Summary(
        f"Without dampers all energy should stay. After {settings(undamped, 'steps')} steps there "
        "is left, in percent:",
        tuple(f"{label(record.solver)}: {_course(record)}" for record in undamped),
    )


def _course(record: Record) -> str:
    left = record.arrays["left"]
    last, low, high = (
        words(metrics.percent(share, 1.0)) for share in (float(left[-1]), *metrics.extent(left))
    )
    return f"{last}, never less than {low} nor more than {high}"


def _milliseconds(records: Sequence[Record]) -> str:
    lengths = {record.settings["h"] for record in records}
    return " or ".join(words(metrics.milliseconds(h)) for h in sorted(lengths)) or "–"
