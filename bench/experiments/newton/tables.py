"""What is proven of every solver's answer to one step of a cloth in mid-swing."""

from collections.abc import Sequence

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, counted, label, settings
from ...presentation.tables import Cell, Column, Summary, Table, words


def certified(results: Results) -> Table:
    """Return every answer with its residuals, the proven distance or why there is none."""
    records = results.all("newton")
    return Table(
        "newton_certified",
        "One step of a cloth in mid-swing: which answers are proven",
        (
            Column("stiffness", "N/m"),
            Column("solver", words=True),
            Column("from", words=True),
            Column("iterations"),
            Column("residual"),
            Column("residual in MuJoCo’s forces"),
            Column("a minimiser within", "m"),
            Column("bound", words=True),
            Column("to Newton’s answer", "m"),
            Column("error"),
            Column("g above Newton’s", "kg m²"),
            Column("Newton’s minimiser", words=True),
        ),
        tuple(_row(record) for record in records),
        shows="Within the distance there is a minimiser of g, and only one: proven, with all "
        "rounding allowed for, from the Newton step, the least eigenvalue of the Hessian and how "
        "fast the Hessian may change. Where there is no bound the column says why, and error and g "
        "are all there is. The error is |x − x*| / |y − x*| for Newton’s answer x*.",
        measured=f"The lab’s cloth of {_sizes(records)} particles under 9.81 m/s², half a second "
        f"after it was let go; one step of {settings(records, 'h')} s, to a residual of "
        f"{settings(records, 'tolerance')}, the rounding floor, or the solver’s last iteration.",
        summary=_summary(records),
    )


def _row(record: Record) -> tuple[Cell, ...]:
    found = record.arrays
    distance = float(found["distance"])
    return (
        _stiffness(record),
        label(record.solver),
        record.settings["start"],
        int(found["iterations"]),
        *(float(found[name]) for name in ("residual", "balance")),
        distance if np.isfinite(distance) else None,
        "yes" if found["covered"] else record.notes["coverage"].lower().replace("_", " "),
        *(float(found[name]) for name in ("apart", "error", "above")),
        "yes" if found["same"] else "no" if found["different"] else "not proven",
    )


def _summary(records: Sequence[Record]) -> Summary:
    if not records:
        return Summary()
    newton = [record for record in records if record.solver == "newton"]
    others = [record for record in records if record.solver != "newton"]
    done = metrics.share(np.array([_is_solved(record) for record in newton]))
    same = [record for record in others if record.arrays["same"]]
    apart = [float(record.arrays["apart"]) for record in same]
    return Summary(
        f"Newton reached the tolerance or the rounding floor in {words(done.hits)} of "
        f"{counted(done.total, 'cloth')}. Of the other solvers’ "
        f"{counted(len(others), 'answer')}, {words(len(same))} are proven to belong to the same "
        f"minimiser, at most {words(metrics.spread(np.array(apart)).largest)} m from Newton’s."
    )


def _is_solved(record: Record) -> bool:
    found = record.arrays
    return bool(found["at_floor"]) or float(found["residual"]) <= record.settings["tolerance"]


def _stiffness(record: Record) -> float:
    return float(record.facts["stiffness"])


def _sizes(records: Sequence[Record]) -> str:
    sizes = sorted({int(record.arrays["size"]) for record in records})
    return " or ".join(f"{size} × {size}" for size in sizes) or "–"
