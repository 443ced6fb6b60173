"""What an answer is as points and lines in space: an arm, a cloth, forces, a curve."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, rotation, solve_ik

from ..contestant import Answer
from ..judgement import CaseJudgement

FloatArray = np.ndarray
Values = Mapping[str, Any]
# Forces are drawn as arrows, the longest so much of the system's extent.
_ARROW = 0.3


class Shape(NamedTuple):
    """Points (point, 3) and the pairs of them (line, 2) that a line joins."""

    points: FloatArray
    lines: FloatArray


class Scene(NamedTuple):
    """A failing case to be drawn.

    Attributes:
        given: what was asked: a curve, the system that forces act on; or None.
        theirs, ours: what was answered; None where it makes no picture.
        marks: points that are wanted or held: a target, pins.
    """

    given: Shape | None
    theirs: Shape | None
    ours: Shape | None
    marks: FloatArray


def scene(judgement: CaseJudgement) -> Scene | None:
    """Return what there is to draw of a case, or None if there is nothing."""
    maker = _MAKERS.get(judgement.case.task)
    if maker is None:
        return None
    inputs = judgement.case.inputs
    theirs, ours = (_shape(maker, inputs, outputs(judgement, side)) for side in SIDES)
    if theirs is None and ours is None:
        return None
    return Scene(_given(judgement), theirs, ours, _marks(inputs))


SIDES = ("theirs", "ours")


def outputs(judgement: CaseJudgement, side: str) -> Values:
    """Return what the solver ("theirs") or the reference ("ours") answered, {} where nothing."""
    if side == "theirs":
        return judgement.answer.values if isinstance(judgement.answer, Answer) else {}
    inputs = judgement.case.inputs
    if not judgement.expected and judgement.case.task == "inverse_kinematics":
        return _one_of_many(inputs)
    return judgement.expected


def _one_of_many(inputs: Values) -> Values:
    """Return a right answer of inverse kinematics, where many are right."""
    skeleton = Skeleton(inputs["parents"], inputs["offsets"])
    try:
        solution = solve_ik(
            skeleton, inputs["local_rotations"], inputs["target"],
            solver="fabrik", effector=int(inputs["effector"]),
        )  # fmt: skip
    except ValueError:
        return {}
    return {"local_rotations": solution.local_rotations}


def pose(inputs: Values, values: Values) -> FloatArray | None:
    """Return the positions (joint, 3) of all joints, of a motion's last frame, or None."""
    if "positions" in values:
        return _last(values["positions"], 2)
    try:
        if "local_rotations" in values:
            unit, _ = rotation.normalise(_last(values["local_rotations"], 2))
            return forward_kinematics(
                Skeleton(inputs["parents"], inputs["offsets"]), unit
            ).positions
        if "rotations" in values:
            return _from_global(inputs, rotation.normalise(values["rotations"])[0])
    except ValueError:  # rotations of length 0, NaN
        pass
    return None


def _last(array: Any, axes: int) -> FloatArray:
    array = np.asarray(array, dtype=float)
    return array if array.ndim == axes else array[-1]


def _from_global(inputs: Values, rotations: FloatArray) -> FloatArray:
    positions = np.array(inputs["offsets"], dtype=float)
    for joint, parent in enumerate(inputs["parents"]):
        if parent >= 0:
            positions[joint] = positions[parent] + rotation.rotate(
                rotations[parent], positions[joint]
            )
    return positions


def _shape(maker: Callable[..., Shape | None], inputs: Values, values: Values) -> Shape | None:
    return maker(inputs, values) if values else None


def _arm(inputs: Values, values: Values) -> Shape | None:
    points = pose(inputs, values)
    parents = np.asarray(inputs["parents"])
    joints = np.flatnonzero(parents >= 0)
    return points if points is None else Shape(points, np.stack([parents[joints], joints], axis=-1))


def _system(inputs: Values, values: Values) -> Shape | None:
    if "positions" not in values:
        return None
    return Shape(_last(values["positions"], 2), np.asarray(inputs["springs"]))


def _forces(inputs: Values, values: Values) -> Shape:
    start, forces = inputs["positions"], np.asarray(values["forces"])
    longest = np.nanmax(np.abs(forces), initial=0.0) or 1.0
    arrows = forces * (_ARROW * max(np.ptp(start, axis=0).max(), 1e-9) / longest)
    count = len(start)
    lines = np.stack([np.arange(count), np.arange(count) + count], axis=-1)
    return Shape(np.concatenate([start, start + arrows]), lines)


def _polyline(inputs: Values, values: Values) -> Shape:
    return _path(np.asarray(values["points"]))


def _path(points: FloatArray) -> Shape:
    steps = np.arange(max(len(points) - 1, 0))
    return Shape(points, np.stack([steps, steps + 1], axis=-1))


_MAKERS: Mapping[str, Callable[[Values, Values], Shape | None]] = {
    "forward_kinematics": _arm,
    "inverse_kinematics": _arm,
    "track": _arm,
    "resample": _polyline,
    "mass_spring_forces": _forces,
    "mass_spring_step": _system,
    "mass_spring_motion": _system,
}


def _given(judgement: CaseJudgement) -> Shape | None:
    inputs = judgement.case.inputs
    if "curve" in inputs:
        return _path(np.asarray(inputs["curve"]))
    if judgement.case.task == "mass_spring_forces":
        return Shape(inputs["positions"], np.asarray(inputs["springs"]))
    return None


def _marks(inputs: Values) -> FloatArray:
    if "target" in inputs:
        return np.asarray(inputs["target"], dtype=float)[None]
    if "pinned" in inputs and "positions" in inputs:
        return np.asarray(inputs["positions"])[np.asarray(inputs["pinned"], dtype=int)]
    return np.empty((0, 3))
