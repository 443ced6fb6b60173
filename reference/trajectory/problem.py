"""What a motion is to follow, and what arrays of frames are asked about it."""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import FREE, FREEDOM, KIND, LEADER, SLIDE
from ..backend.compiled import TwoSpeeds
from ..inverse_kinematics.mechanism import Mechanism
from .smoothness import fill_jumps, move_frames
from .task_derivatives import fill_path

# Errors count as none below this, over the reach.
ON_PATH = 1e-12
MOST_CORRECTIONS = 12
# Added to J J' over the reach squared: a direction that moves no effector does not stop the others.
RIDGE = 1e-14
# A pose is stuck where a singular value of J is below this share of what it is elsewhere, if it is
# not always zero; elsewhere is where every freedom has moved by up to this [rad].
STUCK, NEVER, ELSEWHERE = 1e-3, 1e-9, 0.3

_jumps, _move, _path = (TwoSpeeds(kernel) for kernel in (fill_jumps, move_frames, fill_path))


class Course(NamedTuple):
    """What a motion is to follow.

    Attributes:
        mechanism: what moves.
        worth: what a unit of each freedom is: 1 rad, or for ways the reach [m], (freedom,).
        goals: of each frame, (frame, effector, 8), see `inverse_kinematics/mechanism.py`.
        strict: which frames are to meet their goal; the others are only drawn to it, (frame,).
        closed: whether the first frame follows the last.
    """

    mechanism: Mechanism
    worth: FloatArray
    goals: FloatArray
    strict: np.ndarray
    closed: bool

    def at(self, frames: IndexArray) -> "Course":
        """Return the course of some of the frames."""
        return self._replace(goals=self.goals[frames], strict=self.strict[frames])


def worth_of(mechanism: Mechanism) -> FloatArray:
    """Return what a unit of each freedom is: 1 rad, or for ways the reach [m]."""
    worth = np.ones(mechanism.freedoms)
    for j, row in enumerate(mechanism.joints.integers):
        if row[LEADER] == j and row[KIND] in (SLIDE, FREE):
            worth[row[FREEDOM] : row[FREEDOM] + (1 if row[KIND] == SLIDE else 3)] = mechanism.reach
    return worth


def jumps(course: Course, q: FloatArray) -> FloatArray:
    """Return the jumps, (jump, freedom): as many as frames if closed, else one less."""
    d = np.empty((len(q) - (not course.closed), course.mechanism.freedoms))
    _jumps(course.mechanism.joints, course.worth, q, d)
    return d


def moved(course: Course, q: FloatArray, step: FloatArray) -> FloatArray:
    """Return the frames moved by a step, (frame, freedom)."""
    q = q.copy()
    _move(course.mechanism.joints, course.worth, step, q)
    return q


def path(course: Course, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return errors, (frame, equation), and their derivatives' negatives, over the reach."""
    mechanism = course.mechanism
    e = np.empty((len(q), mechanism.equations))
    J = np.empty((*e.shape, mechanism.freedoms))
    _path(mechanism, course.worth, course.goals, q, e, J)
    return e / mechanism.reach, J / mechanism.reach


def pseudoinverse(J: FloatArray) -> FloatArray:
    """Return the transposed pseudoinverses (J J')^-1 J, (frame, equation, freedom)."""
    A = J @ J.swapaxes(-1, -2) + RIDGE * np.eye(J.shape[-2])
    return np.asarray(np.linalg.solve(A, J), dtype=np.float64)


def restored(course: Course, q: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return the strict frames brought onto the path by the shortest way, and which are there."""
    for _ in range(MOST_CORRECTIONS):
        e, J = path(course, q)
        off = np.abs(e).max(axis=-1) > ON_PATH
        if not (off & course.strict).any():
            break
        step = np.einsum("fe,fek->fk", e, pseudoinverse(J))
        step[~course.strict] = 0.0
        # A longer step comes from a pose that is stuck, and would lead anywhere.
        step[np.abs(step).max(axis=-1) > 1.0] = 0.0
        q = moved(course, q, step)
    return q, ~off


def stuck(course: Course, q: FloatArray) -> np.ndarray:
    """Return which frames have poses that cannot move their effectors in some direction others can.

    Such is a straight arm: from there the path can only be kept to first order.
    """
    frames, n = len(q), course.mechanism.freedoms
    elsewhere = moved(course, q, ELSEWHERE * np.cos(np.arange(frames * n)).reshape(frames, n))
    here, there = (
        np.linalg.svd(path(course, some)[1], compute_uv=False) for some in (q, elsewhere)
    )
    usual = there.max(axis=0)
    return ((here < STUCK * usual) & (usual > NEVER)).any(axis=-1)
