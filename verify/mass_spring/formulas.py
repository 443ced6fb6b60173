"""Formulas of the catalogue of faults: expressions of the numbers of a problem."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..formulas import compiled
from .problem import SpringProblem, accelerations, all_forces, damper_forces, frames, spring_forces

SHORTEST = 1e-150  # of the lengths by which a formula may divide [m]


def _lengths(p: SpringProblem) -> FloatArray:
    return np.maximum(frames(p, p.positions)[0], SHORTEST)


def _stretches(p: SpringProblem) -> FloatArray:
    stretch = _lengths(p) - p.rest_lengths
    return np.where(stretch != 0.0, stretch, 1e-12)


def _limited(p: SpringProblem, x: FloatArray, share: float) -> FloatArray:
    """Return positions in which one spring after the other is at most so much of its rest length.

    Provot (1995): both ends move alike, or the free one alone.
    """
    x, free = x.copy(), np.ones(p.count)
    free[p.pinned] = 0.0
    for (i, j), maximum in zip(p.springs, share * p.rest_lengths, strict=True):
        d, movable = x[i] - x[j], max(free[i] + free[j], 1.0)
        length = max(float(np.linalg.norm(d)), SHORTEST)
        excess = max(length - maximum, 0.0) / (length * movable) * d
        x[i] -= free[i] * excess
        x[j] += free[j] * excess
    return x


def _inertial_positions(p: SpringProblem) -> FloatArray:
    """Return x + h v + h² f/m with the forces that springs have no part in, and the pins at x."""
    moved = p.h * p.velocities + p.h**2 * (p.weights + p.external) / p.inertia
    moved[p.pinned] = 0.0
    return np.asarray(p.positions + moved)


# What the names in a formula stand for.
NAMES: Mapping[str, Callable[[SpringProblem], Any]] = {
    "n": lambda p: p.count,
    "m": lambda p: p.masses,
    "heavy": lambda p: p.weighing,  # the masses that gravity pulls
    "weights": lambda p: p.weights,
    "g": lambda p: p.gravity,
    "external": lambda p: p.external,
    "x": lambda p: p.positions,
    "v": lambda p: p.velocities,
    "x_before": lambda p: p.before[0] if p.before else p.positions,
    "v_before": lambda p: p.before[1] if p.before else p.velocities,
    "s_n": _inertial_positions,
    "h": lambda p: p.h,
    "pins": lambda p: p.pinned,
    "r": lambda p: p.rest_lengths,
    "k": lambda p: p.stiffnesses,
    "c": lambda p: p.dampings,
    "i": lambda p: p.springs[:, 0],
    "j": lambda p: p.springs[:, 1],
    "number": lambda p: np.arange(len(p.springs)),
    "l": _lengths,
    "stretch": _stretches,
    "u": lambda p: frames(p, p.positions)[1],
    "incidence": lambda p: p.incidence,
    "d": lambda p: p.incidence @ p.positions,  # from the second end to the first
    # of the lengths [m/s]
    "rate": lambda p: ((p.incidence @ p.velocities) * frames(p, p.positions)[1]).sum(axis=1),
    "degree": lambda p: np.abs(p.incidence).sum(axis=0),  # the number of springs of a particle
    "f": all_forces,
    "springs": lambda p: spring_forces(p, p.positions),
    "dampers": lambda p: damper_forces(p, p.positions, p.velocities),
    "a": lambda p: accelerations(p, p.positions, p.velocities),
    "length_at": lambda p: lambda x: frames(p, x)[0],
    "forces_at": lambda p: lambda x, v: all_forces(p.changed(positions=x, velocities=v)),
    "limited": lambda p: lambda x, share: _limited(p, x, share),
    # of the numbers of coordinates: all x, all y, all z
    "by_axes": lambda p: np.arange(3 * p.count).reshape(-1, 3).T.ravel(),
    "late": lambda p: p.late,
    "slackable": lambda p: p.tension_only,
    "stiffnesses": lambda p: p.stiffnesses,
    "rest_lengths": lambda p: p.rest_lengths,
    "dampings": lambda p: p.dampings,
    "positions": lambda p: p.positions,
    "velocities": lambda p: p.velocities,
    "steps": lambda p: p.steps or 1,
}
_GLOBALS = {"np": np, "norm": np.linalg.norm, "abs": np.abs, "solve": np.linalg.solve}


class _Values(dict[str, Any]):
    """The values of names in a formula, computed where they are needed."""

    def __init__(self, p: SpringProblem | None, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self._problem = p

    def __missing__(self, name: str) -> Any:
        if self._problem is None:
            raise KeyError(name)
        return NAMES[name](self._problem)


@np.errstate(all="ignore")  # some faults divide by rest lengths, which may be 0
def evaluate(formula: str, p: SpringProblem | None, values: Mapping[str, Any] | None = None) -> Any:
    """Return the value of a formula for a problem, if it needs any, and of further names."""
    return eval(compiled(formula), _GLOBALS, _Values(p, values or {}))
