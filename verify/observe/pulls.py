"""What springs pull and what gravity does, solved from answers of mass-spring systems.

Every answered force, or change of velocity or position, is the sum of the springs' pulls along
their directions and of gravity. Least squares give each pull.
"""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..exchange import Answer
from ..judgement import CaseJudgement
from ..mass_spring.problem import problem_of
from .fits import INDEPENDENT
from .separation import TOLERANCE

# Residuals of rounding: of positions times m / h², in units of the last place.
ROUNDINGS = 8.0
# Cases whose rounding is a larger share of the forces tell nothing.
MAX_ROUNDING = 1e-3
# What a spring may pull, by the stiffness k, length l, rest length r, damping c and rate dl/dt.
PULLS: Mapping[str, Any] = {
    "k l": lambda s: s.k * s.l,
    "k r": lambda s: s.k * s.r,
    "k": lambda s: s.k,
    "k l²": lambda s: s.k * s.l**2,
    "k r²": lambda s: s.k * s.r**2,
    "k l²/r": lambda s: s.k * s.l**2 / s.r,
    "k l³/r²": lambda s: s.k * s.l**3 / s.r**2,
    "k r²/l": lambda s: s.k * s.r**2 / s.l,
    "k l³": lambda s: s.k * s.l**3,
    "k r² l": lambda s: s.k * s.r**2 * s.l,
    "c dl/dt": lambda s: s.c * s.rate,
    "c": lambda s: s.c,
    "dl/dt": lambda s: s.rate,
    "k l/h": lambda s: s.k * s.l / s.h,
    "k r/h": lambda s: s.k * s.r / s.h,
    "c (l' - l)/h": lambda s: s.c * (s.l - s.first_length) / s.h,
}
OF_STEPS = ("k l/h", "k r/h", "c (l' - l)/h")


class SpringCase:
    """A request and its answer, as arrays."""

    def __init__(self, judgement: CaseJudgement, epsilon: float, is_damped: bool = True) -> None:
        assert isinstance(judgement.answer, Answer)
        self.name, outputs = judgement.case.name, judgement.answer.values
        p = problem_of(judgement.case.inputs)
        p = self.problem = p if is_damped else p.changed(dampings=0.0 * p.dampings)
        self.x, self.v, self.h = p.positions, p.velocities, p.h or 1.0
        self.masses, self.gravity = p.masses[:, None], p.gravity
        self.free = np.setdiff1d(np.arange(p.count), p.pinned)
        self.acting = (p.stiffnesses > 0.0) | (p.dampings > 0.0)  # springs with either
        self.end, self.end_v = outputs.get("positions"), outputs.get("velocities")
        self.forces, self.epsilon = outputs.get("forces"), epsilon

    def rounding(self) -> float:
        """Return the error of a force by the rounding of the answers [N]."""
        if self.forces is not None:
            return ROUNDINGS * self.epsilon * float(np.abs(self.forces).max())
        size = float(np.abs(self.x).max() + self.h * np.abs(self.v).max())
        return ROUNDINGS * self.epsilon * float(self.masses.max()) * size / self.h**2

    @cached_property
    def size(self) -> float:
        """A bound of the terms of forces, by which errors are divided [N]."""
        p = self.problem
        springs = np.abs(p.incidence).T @ (p.stiffnesses * p.rest_lengths + p.dampings)
        weights = p.masses * float(np.linalg.norm(p.gravity))
        return max(float((springs + weights).max()), 1e-300)

    def features(self) -> dict[str, bool]:
        """Return the features of the case as a whole."""
        springs = int(self.acting.sum())
        return {
            "springs": springs > 0,
            "several_springs": springs > 1,
            "pins": bool(len(self.problem.pinned)),
            "dampers": self.problem.damped,
        }

    def particle_features(self) -> dict[str, BoolArray]:
        """Return the features of all particles."""
        touches = self.problem.incidence[self.acting] != 0.0
        return {"several_springs_here": touches.sum(axis=0) > 1}


class ForceReading:
    """A force from an answer, with the acting springs at some positions.

    Attributes:
        name: a key of READINGS.
        force: on all particles [N].
        k, c, r, l, u: stiffness, damping, rest length, length and direction of the acting springs.
        rate: dl/dt of the velocities that dampers see.
        first_length: the lengths in the request.
        h: time step.
    """

    def __init__(
        self, name: str, case: SpringCase, force: FloatArray, x: FloatArray, v: FloatArray
    ) -> None:
        p, acting = case.problem, case.acting
        self.name, self.force, self.h = name, force, case.h
        d, w, start = (p.incidence[acting] @ values for values in (x, v, case.x))
        self.l, self.first_length = (np.linalg.norm(edges, axis=1) for edges in (d, start))
        self.u = d / np.maximum(self.l, 1e-300)[:, None]
        self.k, self.c, self.r = p.stiffnesses[acting], p.dampings[acting], p.rest_lengths[acting]
        self.rate = (w * self.u).sum(axis=1)

    def terms(self) -> dict[str, FloatArray]:
        """Return what springs may pull, by symbols."""
        with np.errstate(all="ignore"):
            return {symbol: np.nan_to_num(rule(self)) for symbol, rule in PULLS.items()}


# Where the springs of a reading are taken.
READINGS: Mapping[str, Sentence] = {
    "forces": sentence("in the positions of the request"),
    "start": sentence("at the start of the step"),
    "end": sentence("at the end of the step"),
    "start, velocities": sentence("at the start of the step, by the velocities"),
    "end, velocities": sentence("at the end of the step, by the velocities"),
    "rest directions": sentence("in its rest direction, in the first iteration from x_n"),
    "rest directions from y": sentence("in its rest direction, in the first iteration from y"),
}


def _is_explicit(case: SpringCase) -> bool:
    """Return whether particles move by the old velocities, so that positions show no force."""
    if case.end is None or case.end_v is None:
        return False
    gaps = np.abs(case.end - case.x - case.h * case.v)[case.free]
    return bool(gaps.max(initial=0.0) <= TOLERANCE * np.abs(case.end - case.x).max(initial=0.0))


def readings_of(case: SpringCase) -> Iterator[ForceReading]:
    """Yield the force of an answer with springs at the start and at the end of the step."""
    x, v, h = case.x, case.v, case.h
    end = None if _is_explicit(case) else case.end
    if case.forces is not None:
        yield ForceReading("forces", case, case.forces, x, v)
    if end is not None:
        by_x = case.masses * (end - x - h * v) / h**2
        yield ForceReading("start", case, by_x, x, v)
        yield ForceReading("end", case, by_x, end, (end - x) / h)
    if case.end_v is not None:
        by_v = case.masses * (case.end_v - v) / h
        yield ForceReading("start, velocities", case, by_v, x, v)
        if end is not None:
            yield ForceReading("end, velocities", case, by_v, end, v)
    # a damper is read in other directions than a spring in an iteration: leave these cases out
    if end is not None and not case.problem.damped:
        p = case.problem
        stretched = by_x + p.incidence.T @ (p.stiffnesses[:, None] * (p.incidence @ end))
        yield ForceReading("rest directions", case, stretched, x, v)
        yield ForceReading("rest directions from y", case, stretched, x + h * v, v)


class Pulls(NamedTuple):
    """What springs pull in an answer, and gravity, solved from a reading."""

    case: SpringCase
    pulls: FloatArray  # of the acting springs [N]
    gravity: FloatArray | None  # [m/s²], None if taken from the request
    terms: Mapping[str, FloatArray]  # by symbols
    is_elastic: BoolArray  # which springs have no damper


def solve_pulls(case: SpringCase, reading: ForceReading) -> Pulls | None:
    """Return pulls and gravity, None for an indeterminate answer or another sum."""
    p, acting, free = case.problem, case.acting, case.free
    count, incidence = int(acting.sum()), p.incidence[acting]
    is_measured = 3 * len(free) > count + 3
    if 3 * len(free) <= count:
        return None
    blocks = np.zeros((len(free), 3, count + 3))
    blocks[:, :, :count] = -incidence.T[free, None, :] * reading.u.T[None]
    blocks[:, :, count:] = case.masses[free, :, None] * np.eye(3)
    A: FloatArray = blocks.reshape(-1, count + 3)
    b = (reading.force - p.external)[free].ravel()
    if not is_measured:  # too few equations: take gravity from the request
        A, b = A[:, :count], b - (case.masses * case.gravity)[free].ravel()
    size = float(np.abs(b).max())
    allowed = max(TOLERANCE * size, case.rounding())
    if allowed > MAX_ROUNDING * size:
        return None
    least_squares, _, rank, _ = np.linalg.lstsq(A, b, INDEPENDENT)
    solution: FloatArray = np.asarray(least_squares, dtype=float)
    if rank < A.shape[1] or not np.abs(A @ solution - b).max() <= allowed:
        return None
    gravity = solution[count:] if is_measured else None
    return Pulls(case, solution[:count], gravity, reading.terms(), reading.c == 0.0)
