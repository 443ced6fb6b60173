"""What springs pull and what gravity does, solved from answers of mass-spring systems.

Every answered force, or change of velocity or position, is the sum of what springs pull along their
directions and of gravity; least squares give each pull.
"""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..contestant import Answer
from ..judgement import CaseJudgement
from ..mass_spring.problem import SpringProblem, problem_of
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

    def __init__(self, judgement: CaseJudgement, epsilon: float) -> None:
        assert isinstance(judgement.answer, Answer)
        self.name, self.case = judgement.case.name, judgement.case
        self.problem: SpringProblem = problem_of(judgement.case.inputs)
        p, outputs = self.problem, judgement.answer.values
        self.x, self.v, self.h = p.positions, p.velocities, p.h or 1.0
        self.masses, self.gravity = p.masses[:, None], p.gravity
        self.free = np.setdiff1d(np.arange(p.count), p.pinned)
        self.end, self.end_v = outputs.get("positions"), outputs.get("velocities")
        self.forces = outputs.get("forces")
        self.epsilon = epsilon

    @cached_property
    def acting(self) -> BoolArray:
        """The springs with a stiffness or a damping."""
        return (self.problem.stiffnesses > 0.0) | (self.problem.dampings > 0.0)

    def by_positions(self) -> FloatArray | None:
        """Return the force that moves positions further than the old velocities [N]."""
        if self.end is None:
            return None
        return self.masses * (self.end - self.x - self.h * self.v) / self.h**2

    def by_velocities(self) -> FloatArray | None:
        """Return the force that changes velocities [N]."""
        return None if self.end_v is None else self.masses * (self.end_v - self.v) / self.h

    def rounding(self) -> float:
        """Return the error of such a force that rounding of the answers leaves [N]."""
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
        p, acting = self.problem, self.acting
        lengths = np.linalg.norm(p.incidence @ self.x, axis=1)
        return {
            "springs": bool(acting.any()),
            "several_springs": int(acting.sum()) > 1,
            "pins": bool(len(p.pinned)),
            "dampers": p.damped,
            "compressed": bool((acting & (lengths < p.rest_lengths - 1e-9)).any()),
        }

    def particle_features(self) -> dict[str, BoolArray]:
        """Return the features of all particles."""
        p, indices = self.problem, np.arange(self.problem.count)
        touches = p.incidence[self.acting] != 0.0
        is_at_pin = touches[:, p.pinned].any(axis=1)
        return {
            "several_springs_here": touches.sum(axis=0) > 1,
            "next_to_pin": touches[is_at_pin].any(axis=0),
            "first_particle": indices == 0,
            "last_particle": indices == p.count - 1,
        }


class ForceReading:
    """A force that follows from an answer, with the acting springs at some positions.

    Attributes:
        name: a key of READINGS.
        force: on all particles [N].
        k, c, r, l, u: stiffness, damping, rest length, length and direction of the acting springs.
        rate: dl/dt of the velocities that dampers see.
        first_length: the lengths in the request.
        h: time step.
    """

    def __init__(
        self, name: str, case: "SpringCase", force: FloatArray, x: FloatArray, v: FloatArray
    ) -> None:
        p, acting = case.problem, case.acting
        self.name, self.force, self.h = name, force, case.h
        first, second = p.springs[acting].T
        d, w, start = (values[first] - values[second] for values in (x, v, case.x))
        self.l = np.sqrt((d * d).sum(axis=1))
        self.u = d / np.maximum(self.l, 1e-300)[:, None]
        self.k, self.c, self.r = p.stiffnesses[acting], p.dampings[acting], p.rest_lengths[acting]
        self.rate = (w * self.u).sum(axis=1)
        self.first_length = np.sqrt((start * start).sum(axis=1))

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


def readings_of(case: SpringCase) -> Iterator[ForceReading]:
    """Yield the force of an answer with springs at the start and at the end of the step."""
    if case.forces is not None:
        yield ForceReading("forces", case, case.forces, case.x, case.v)
    by_x, by_v, x, end = case.by_positions(), case.by_velocities(), case.x, case.end
    if by_x is not None and end is not None:
        yield ForceReading("start", case, by_x, x, case.v)
        yield ForceReading("end", case, by_x, end, (end - x) / case.h)
    if by_v is not None:
        yield ForceReading("start, velocities", case, by_v, x, case.v)
        if end is not None:
            yield ForceReading("end, velocities", case, by_v, end, case.v)
    # a damper is read in other directions than a spring in an iteration: leave such cases out
    if by_x is not None and end is not None and not case.problem.damped:
        p = case.problem
        pulls = p.stiffnesses[:, None] * (end[p.springs[:, 0]] - end[p.springs[:, 1]])
        stretched = by_x + p.incidence.T @ pulls
        yield ForceReading("rest directions", case, stretched, x, case.v)
        yield ForceReading("rest directions from y", case, stretched, x + case.h * case.v, case.v)


class Pulls(NamedTuple):
    """What springs pull in an answer, and gravity, solved from a reading."""

    case: SpringCase
    pulls: FloatArray  # of the acting springs [N]
    gravity: FloatArray | None  # [m/s²], None if taken from the request
    terms: Mapping[str, FloatArray]  # by symbols
    features: Mapping[str, BoolArray]


def solve_pulls(case: SpringCase, reading: ForceReading) -> Pulls | None:
    """Return pulls and gravity, None if an answer does not determine them or is no such sum."""
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
    features = {
        "damped_spring": reading.c > 0.0,
        "compressed_spring": reading.first_length < reading.r,
        "spring_to_pin": np.isin(p.springs[acting], p.pinned).any(axis=1),
    }
    gravity = solution[count:] if is_measured else None
    return Pulls(case, solution[:count], gravity, reading.terms(), features)
