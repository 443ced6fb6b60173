"""What is proven of every solver's answer to one step of a cloth in mid-swing."""

from collections.abc import Sequence

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import counted, settings
from ...tables.columns import SOLVER, folded, least, number, text
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from .problem import FRAMES, GRAVITY, H


def _distance(record: Record) -> float | None:
    distance = float(record.arrays["distance"])
    return distance if np.isfinite(distance) else None


def _bound(record: Record) -> str:
    if record.arrays["covered"]:
        return "yes"
    return record.notes["coverage"].lower().replace("_", " ")


def _same(record: Record) -> str:
    if record.arrays["same"]:
        return "yes"
    return "no" if record.arrays["different"] else "not proven"


def _summary(records: Sequence[Record]) -> Summary:
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


def _sizes(records: Sequence[Record]) -> str:
    sizes = sorted({int(record.arrays["size"]) for record in records})
    return " or ".join(f"{size} × {size}" for size in sizes) or "–"


certified = Layout(
    "Which answers to a hard step are proven?",
    "newton_certified",
    "One step of a cloth in mid-swing: which answers are proven",
    subjects=lambda results: results.all("newton"),
    columns=(
        Column("stiffness", "N/m", read=lambda record: float(record.facts["stiffness"])),
        SOLVER,
        text("from", lambda record: record.settings["start"]),
        number("iterations"),
        *least([number("residual")]),
        *folded([number("residual in MuJoCo’s forces", "balance")]),
        Column("a minimiser within", "m", read=_distance, best="least"),
        *folded(
            [
                text("bound", _bound),
                number("to Newton’s answer", "apart", "m"),
                number("error"),
                number("g above Newton’s", "above", "kg m²"),
            ]
        ),
        text("Newton’s minimiser", _same),
    ),
    shows="Within the distance there is a minimiser of g, and only one: proven, with all "
    "rounding allowed for, from the Newton step, the least eigenvalue of the Hessian and how "
    "fast the Hessian may change. Where there is no bound the column says why, and error and g "
    "are all there is. The error is |x − x*| / |y − x*|; x* is Newton’s answer to 25 digits.",
    measured=lambda records: (
        f"The lab’s cloth of {_sizes(records)} particles under {GRAVITY:g} m/s², {FRAMES * H:g} s "
        f"after it was let go; one step of {settings(records, 'h')} s, to a residual of "
        f"{settings(records, 'tolerance')}, the rounding floor, or the solver’s last iteration."
    ),
    summary=_summary,
)


LAYOUTS = (certified,)
