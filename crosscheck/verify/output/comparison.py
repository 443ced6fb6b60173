"""A few numbers of a wrong answer beside ours, from where the two part."""

from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import digits_apart

from ..contestant import Answer
from ..judgement import CaseJudgement
from .geometry import outputs, pose

# Differences below this part of the largest one are not where two answers part.
_PARTING = 0.01
# An output that differs by less than this part of another one is rounded, not wrong.
_ROUNDED = 1e-4


class Row(NamedTuple):
    """Numbers that should be equal: what they are, the solver's, and ours."""

    label: str
    theirs: list[float]
    ours: list[float]


def rows(judgement: CaseJudgement, most: int = 3) -> list[Row]:
    """Return the first numbers, in the order of the computation, in which answers part."""
    if not isinstance(judgement.answer, Answer):
        return []
    found: list[Row] = []
    for name, ours in judgement.expected.items():
        if name in judgement.answer.values:
            found += _of_output(name, judgement.answer.values[name], ours, most)
    largest = max(map(_gap, found), default=0.0)
    wrong_rows = [row for row in found if _gap(row) >= _ROUNDED * largest]
    return (wrong_rows or _effector(judgement))[:most]


def _gap(row: Row) -> float:
    return float(np.nan_to_num(np.abs(np.subtract(row.theirs, row.ours)), nan=np.inf).max())


def _of_output(name: str, theirs: Any, ours: Any, most: int) -> list[Row]:
    a, b = np.asarray(theirs, dtype=float), np.asarray(ours, dtype=float)
    if a.shape != b.shape:
        return [Row(f"len({name})", [float(len(a))], [float(len(b))])]
    if name.endswith("rotations"):
        b = b * np.where((a * b).sum(-1, keepdims=True) < 0.0, -1.0, 1.0)
    apart = np.nan_to_num(np.abs(a - b), nan=np.inf)
    if a.ndim:
        apart = apart.max(-1)
    worst = apart.max(initial=0.0)
    parted = np.argwhere((apart > 0.0) & (apart >= _PARTING * worst))[:most]
    return [_row(name, a, b, tuple(map(int, i))) for i in parted]


def _row(name: str, a: Any, b: Any, i: tuple[int, ...]) -> Row:
    label = f"{name}[{', '.join(map(str, i))}]" if i else name
    return Row(label, np.atleast_1d(a[i]).tolist(), np.atleast_1d(b[i]).tolist())


def _effector(judgement: CaseJudgement) -> list[Row]:
    """Return where the effector is beside where it should be, if the case is about that."""
    inputs = judgement.case.inputs
    if "target" not in inputs:
        return []
    positions = pose(inputs, outputs(judgement, "theirs"))
    if positions is None:
        return []
    reached = positions[int(inputs["effector"])]
    return [Row("effector", reached.tolist(), np.asarray(inputs["target"]).tolist())]


def written(row: Row) -> tuple[str, str]:
    """Return both sides with so few digits that they still differ where they differ most."""
    apart = [
        0.0 if a == b else abs(a - b) if np.isfinite([a, b]).all() else np.inf
        for a, b in zip(row.theirs, row.ours, strict=True)
    ]
    worst = int(np.argmax(apart))
    digits = digits_apart(row.theirs[worst], row.ours[worst], 4)
    sides = [[f"{x:.{digits}g}".replace("nan", "NaN") for x in side] for side in row[1:]]
    width = max(len(text) for side in sides for text in side)
    theirs, ours = ("  ".join(text.rjust(width) for text in side) for side in sides)
    return theirs, ours
