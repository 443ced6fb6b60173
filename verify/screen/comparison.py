"""An answer beside the expected answer: differing numbers, and points to draw."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, local_from_global, rotation
from plumbob.reference.arguments import FloatArray, digits_apart

from ..exchange import Answer
from ..judgement import CaseJudgement

Outputs = Mapping[str, Any]
# Two answers part at differences above this part of the largest difference, or above the next part
# of the largest number.
_PARTING = 0.01
# An output is rounded, not wrong, if its difference is below this part of another output's.
_ROUNDED = 1e-4
# So are numbers within this part of the largest number of their output.
_ROUNDING = 1e-12
# The length of the longest force arrow, relative to the system's extent.
_ARROW = 0.3


class NumberRow(NamedTuple):
    """Numbers to be equal."""

    label: str
    answer: list[float]
    expected: list[float]


class Wireframe(NamedTuple):
    """Points (point, 3), and lines as pairs of point indices (line, 2)."""

    points: FloatArray
    lines: FloatArray


class CaseDrawing(NamedTuple):
    """The wireframes of a failing case; None where there is none."""

    request: Wireframe | None  # a curve, or the system that forces act on
    answer: Wireframe | None
    expected: Wireframe | None
    marks: FloatArray  # a target, or pins (point, 3)


def _positions(inputs: Outputs, outputs: Outputs) -> FloatArray | None:
    """Return the positions (joint, 3) of all joints, of a motion's last frame, or None."""
    if "positions" in outputs:
        return _last(outputs["positions"])
    try:
        skeleton = Skeleton(inputs["parents"], inputs["offsets"])
        if "local_rotations" in outputs:
            unit, _ = rotation.normalise(_last(outputs["local_rotations"]))
        elif "rotations" in outputs:
            unit = local_from_global(skeleton, rotation.normalise(outputs["rotations"])[0])
        else:
            return None
        return forward_kinematics(skeleton, unit).positions
    except ValueError:  # rotations of length 0, NaN
        return None


def _last(array: Any) -> FloatArray:
    frames = np.asarray(array, dtype=float)
    return frames if frames.ndim == 2 else frames[-1]


def rows(judgement: CaseJudgement, count: int = 3) -> list[NumberRow]:
    """Return the first numbers in which answers part, and the number of the largest gap."""
    if not isinstance(judgement.answer, Answer):
        return []
    differing: list[NumberRow] = []
    for name, expected in judgement.expected.items():
        if name in judgement.answer.values:
            differing += _of_output(name, judgement.answer.values[name], expected, count)
    gaps = [
        float(np.nan_to_num(np.abs(np.subtract(row.answer, row.expected)), nan=np.inf).max())
        for row in differing
    ]
    largest = max(filter(np.isfinite, gaps), default=0.0)
    wrong = [i for i, gap in enumerate(gaps) if gap >= _ROUNDED * largest]
    if wrong:
        return [differing[wrong[i]] for i in _first_and_largest([gaps[i] for i in wrong], count)]
    inputs, outputs = judgement.case.inputs, judgement.answer.values
    return (_disagreeing(inputs, outputs, count) or _effector(inputs, outputs))[:count]


def _first_and_largest(gaps: Sequence[float], count: int) -> list[int]:
    """Return the indices of the first gaps, among them the index of the largest gap."""
    indices, largest = list(range(len(gaps)))[:count], int(np.argmax(gaps))
    return indices if largest in indices else [*indices[:-1], largest]


def _of_output(name: str, answer: Any, expected: Any, count: int) -> list[NumberRow]:
    a, b = np.asarray(answer, dtype=float), np.asarray(expected, dtype=float)
    if a.shape != b.shape:
        return [NumberRow(f"len({name})", [float(len(a))], [float(len(b))])]
    if name.endswith("rotations"):
        b = b * np.where((a * b).sum(-1, keepdims=True) < 0.0, -1.0, 1.0)
    gaps = np.nan_to_num(np.abs(a - b), nan=np.inf)
    if a.ndim:
        gaps = gaps.max(-1)
    size = np.abs(b).max(initial=0.0) or np.abs(a[np.isfinite(a)]).max(initial=0.0)
    threshold = max(min(_PARTING * gaps.max(initial=0.0), _ROUNDED * size), _ROUNDING * size)
    parting = [tuple(index) for index in np.argwhere((gaps > 0.0) & (gaps >= threshold)).tolist()]
    places = _first_and_largest([gaps[i] for i in parting], count) if parting else []
    indices = [parting[i] for i in places]
    return [
        NumberRow(
            f"{name}[{', '.join(map(str, i))}]" if i else name,
            *((np.atleast_1d(array[i]) + 0.0).tolist() for array in (a, b)),  # -0 is 0
        )
        for i in indices
    ]  # fmt: skip


def _disagreeing(inputs: Outputs, outputs: Outputs, count: int) -> list[NumberRow]:
    """Return the answered positions away from the positions by the answered rotations."""
    if "target" not in inputs or not {"positions", "local_rotations"} <= outputs.keys():
        return []
    placed = _positions(inputs, {"local_rotations": outputs["local_rotations"]})
    gaps = np.abs(np.subtract(outputs["positions"], placed if placed is not None else 0.0))
    if placed is None or gaps.max() <= _ROUNDED * np.abs(placed).max():
        return []
    return _of_output("positions", outputs["positions"], placed, count)


def _effector(inputs: Outputs, outputs: Outputs) -> list[NumberRow]:
    """Return the position of the effector beside a missed target, if any."""
    positions = _positions(inputs, outputs) if "target" in inputs else None
    if positions is None:
        return []
    reached, target = positions[int(inputs["effector"])], np.asarray(inputs["target"])
    if np.linalg.norm(reached - target) <= inputs.get("tolerance", 0.0):
        return []
    return [NumberRow("effector", reached.tolist(), target.tolist())]


def texts(row: NumberRow) -> tuple[str, str]:
    """Return both sides of a row, with the fewest digits for their largest difference."""
    gaps = [
        0.0 if a == b else abs(a - b) if np.isfinite([a, b]).all() else np.inf
        for a, b in zip(row.answer, row.expected, strict=True)
    ]
    worst = int(np.argmax(gaps))
    digits = digits_apart(row.answer[worst], row.expected[worst], 4)
    sides = [[f"{x:.{digits}g}".replace("nan", "NaN") for x in side] for side in row[1:]]
    width = max(len(text) for side in sides for text in side)
    answer, expected = ("  ".join(text.rjust(width) for text in side) for side in sides)
    return answer, expected


def drawing_of(judgement: CaseJudgement) -> CaseDrawing | None:
    """Return the wireframes of a case, or None if there are none."""
    inputs, task = judgement.case.inputs, judgement.case.task
    answer_values = judgement.answer.values if isinstance(judgement.answer, Answer) else {}
    answer, expected = (_shape(task, inputs, x) for x in (answer_values, judgement.expected))
    if answer is None and expected is None:
        return None
    request, marks = None, np.empty((0, 3))
    if "curve" in inputs:
        request = _path(inputs["curve"])
    elif task == "mass_spring_forces":
        request = Wireframe(inputs["positions"], np.asarray(inputs["springs"]))
    if "target" in inputs:
        marks = np.asarray(inputs["target"], dtype=float)[None]
    elif "pinned" in inputs and "positions" in inputs:
        marks = np.asarray(inputs["positions"])[np.asarray(inputs["pinned"], dtype=int)]
    return CaseDrawing(request, answer, expected, marks)


def _shape(task: str, inputs: Outputs, outputs: Outputs) -> Wireframe | None:
    """Return an answer as points and lines, or None."""
    if not outputs:
        return None
    if task in ("forward_kinematics", "inverse_kinematics", "track"):
        points, parents = _positions(inputs, outputs), np.asarray(inputs["parents"])
        joints = np.flatnonzero(parents >= 0)
        return (
            points if points is None else Wireframe(points, np.stack([parents[joints], joints], 1))
        )
    if task in ("mass_spring_step", "mass_spring_motion") and "positions" in outputs:
        return Wireframe(_last(outputs["positions"]), np.asarray(inputs["springs"]))
    if task == "mass_spring_forces":
        start, forces = inputs["positions"], np.asarray(outputs["forces"])
        longest = np.nanmax(np.abs(forces), initial=0.0) or 1.0
        ends = start + forces * (_ARROW * max(np.ptp(start, axis=0).max(), 1e-9) / longest)
        first = np.arange(len(start))
        return Wireframe(np.concatenate([start, ends]), np.stack([first, first + len(start)], 1))
    return _path(outputs["points"]) if task == "resample" else None


def _path(curve: Any) -> Wireframe:
    points = np.asarray(curve)
    first = np.arange(max(len(points) - 1, 0))
    return Wireframe(points, np.stack([first, first + 1], 1))
