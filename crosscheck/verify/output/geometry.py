"""What an answer is as points and lines in space: an arm, a cloth, forces, a curve."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, local_from_global, rotation, solve_ik

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
    """A failing case to be drawn."""

    given: Shape | None  # what was asked: a curve, the system that forces act on; or None
    theirs: Shape | None  # theirs, ours: what was answered; None where it makes no picture
    ours: Shape | None
    marks: FloatArray  # points that are wanted or held: a target, pins


def scene(judgement: CaseJudgement) -> Scene | None:
    """Return what there is to draw of a case, or None if there is nothing."""
    inputs, task = judgement.case.inputs, judgement.case.task
    theirs, ours = (_shape(task, inputs, outputs(judgement, side)) for side in SIDES)
    if theirs is None and ours is None:
        return None
    return Scene(_given(task, inputs), theirs, ours, _marks(inputs))


SIDES = ("theirs", "ours")


def outputs(judgement: CaseJudgement, side: str) -> Values:
    """Return what the solver ("theirs") or the reference ("ours") answered, {} where nothing."""
    if side == "theirs":
        return judgement.answer.values if isinstance(judgement.answer, Answer) else {}
    if not judgement.expected and judgement.case.task == "inverse_kinematics":
        return _one_of_many(judgement.case.inputs)
    return judgement.expected


def _one_of_many(inputs: Values) -> Values:
    """Return a right answer of inverse kinematics, where many are right."""
    skeleton = Skeleton(inputs["parents"], inputs["offsets"])
    start, target, effector = (inputs[k] for k in ("local_rotations", "target", "effector"))
    try:
        solution = solve_ik(skeleton, start, target, solver="fabrik", effector=int(effector))
    except ValueError:
        return {}
    return {"local_rotations": solution.local_rotations}


def pose(inputs: Values, values: Values) -> FloatArray | None:
    """Return the positions (joint, 3) of all joints, of a motion's last frame, or None."""
    if "positions" in values:
        return _last(values["positions"])
    try:
        skeleton = Skeleton(inputs["parents"], inputs["offsets"])
        if "local_rotations" in values:
            unit, _ = rotation.normalise(_last(values["local_rotations"]))
        elif "rotations" in values:
            unit = local_from_global(skeleton, rotation.normalise(values["rotations"])[0])
        else:
            return None
        return forward_kinematics(skeleton, unit).positions
    except ValueError:  # rotations of length 0, NaN
        return None


def _last(array: Any) -> FloatArray:
    frames = np.asarray(array, dtype=float)
    return frames if frames.ndim == 2 else frames[-1]


def _shape(task: str, inputs: Values, values: Values) -> Shape | None:
    """Return an answer as points and lines, None if it is none that can be drawn."""
    if not values:
        return None
    if task in ("forward_kinematics", "inverse_kinematics", "track"):
        points, parents = pose(inputs, values), np.asarray(inputs["parents"])
        joints = np.flatnonzero(parents >= 0)
        return points if points is None else Shape(points, np.stack([parents[joints], joints], 1))
    if task in ("mass_spring_step", "mass_spring_motion") and "positions" in values:
        return Shape(_last(values["positions"]), np.asarray(inputs["springs"]))
    if task == "mass_spring_forces":
        return _arrows(inputs["positions"], np.asarray(values["forces"]))
    return _path(values["points"]) if task == "resample" else None


def _arrows(start: FloatArray, forces: FloatArray) -> Shape:
    longest = np.nanmax(np.abs(forces), initial=0.0) or 1.0
    ends = start + forces * (_ARROW * max(np.ptp(start, axis=0).max(), 1e-9) / longest)
    first = np.arange(len(start))
    return Shape(np.concatenate([start, ends]), np.stack([first, first + len(start)], 1))


def _path(curve: Any) -> Shape:
    points = np.asarray(curve)
    first = np.arange(max(len(points) - 1, 0))
    return Shape(points, np.stack([first, first + 1], 1))


def _given(task: str, inputs: Values) -> Shape | None:
    if "curve" in inputs:
        return _path(inputs["curve"])
    if task == "mass_spring_forces":
        return Shape(inputs["positions"], np.asarray(inputs["springs"]))
    return None


def _marks(inputs: Values) -> FloatArray:
    if "target" in inputs:
        return np.asarray(inputs["target"], dtype=float)[None]
    if "pinned" in inputs and "positions" in inputs:
        return np.asarray(inputs["positions"])[np.asarray(inputs["pinned"], dtype=int)]
    return np.empty((0, 3))
