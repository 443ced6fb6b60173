"""Proven distances between the solutions of a step and its minimiser."""

from collections.abc import Sequence

import numpy as np

from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import counted, label, listed
from ...tables.table import Summary, words
from . import FRAME, FRAMES, GRAVITY
from .values import CertifiedStep

CAPTIONS = Captions(__file__, gravity=f"{GRAVITY:g}", time=f"{FRAMES * FRAME:g}")


def _row(record: Record) -> Row:
    step: CertifiedStep = record.values
    minimiser = "yes" if step.same else "no" if step.different else "not proven"
    return {
        "record": record,
        "stiffness": step.stiffness,
        "solver": label(record.solver),
        "start": step.start,
        "iterations": step.iterations,
        "residual": step.residual,
        "distance to a minimiser, at most": step.distance if np.isfinite(step.distance) else None,
        "same minimiser as Newton": minimiser,
        "residual in MuJoCo’s forces": step.balance,
        "bound": "yes" if step.covered else step.coverage.lower().replace("_", " "),
        "distance to Newton’s solution": step.newton_distance,
        "error": step.error,
        "g above Newton’s": step.above,
    }


def _summary(rows: Sequence[Row]) -> Summary:
    records = [row["record"] for row in rows]
    newton = [record for record in records if record.solver == "newton"]
    rivals = [record for record in records if record.solver != "newton"]
    solved = sum(r.values.at_floor or r.values.residual <= r.values.tolerance for r in newton)
    distances = [record.values.newton_distance for record in rivals if record.values.same]
    nearby = f", at most {words(max(distances))} m from Newton’s" if distances else ""
    first = (
        f"Newton reached the tolerance or the rounding floor in {words(solved)} of "
        f"{counted(len(newton), 'cloth')}. "
    )
    return Summary(
        f"{first if newton else ''}Of the other solvers’ "
        f"{counted(len(rivals), 'solution')}, {words(len(distances))} are proven to belong to the "
        f"same minimiser{nearby}."
    )


def _sizes(rows: Sequence[Row]) -> dict[str, str]:
    sizes = sorted({int(row["record"].values.size) for row in rows})
    return {"sizes": listed([f"{size} × {size}" for size in sizes], "or")}


proofs = CAPTIONS.layout(
    "cloth_proofs", lambda results: map(_row, results.all("newton")), _summary, measured=_sizes
)

LAYOUTS = (proofs,)
