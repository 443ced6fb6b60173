"""How far rounding may take an answer from what exact arithmetic gives."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .model import StepModel
from .problem import SpringProblem

# A sum of some ten terms, a few products and a square root, each rounded by half an epsilon, as
# the inputs themselves are in single precision.
ROUNDINGS = 4.0
# What an iterative linear solver may leave of a displacement, and a velocity, without being taken
# for another model.
SOLVED = 1e-6


class Rounding(NamedTuple):
    """What rounding may change."""

    positions: float  # [m]
    velocities: float  # [m/s]


def rounding(p: SpringProblem, model: StepModel, epsilon: float) -> Rounding:
    """Return bounds for an honest solver of that precision.

    A coordinate is rounded by epsilon of its size in each substep, always to the same side where
    the increments are alike. Lengths are rounded as coordinates are, and h² k / m of them enters
    the right-hand side of a step; M + h² L is conditioned by 1 + h² k / m. An unstable explicit
    step multiplies what came before by hs² k / m. The largest eigenvalue of M^-1 L is bounded by
    the largest sum of |k| + |c| / h over the springs of a particle, times 2 / m.
    """
    stiffness = np.abs(p.stiffnesses) + np.abs(p.dampings) / p.h
    stiffest = float((2.0 * np.abs(p.incidence).T @ stiffness / p.masses).max(initial=0.0))
    n, steps, growth = model.substeps, p.steps or 1, 1.0
    if model.integrator.explicit:
        growth = min(max(1.0, stiffest * (p.h / n) ** 2) ** (n - 1), 1e12)
    size = np.abs(p.positions).max() + p.h * steps * np.abs(p.velocities).max()
    size += (p.h * steps) ** 2 * float(np.linalg.norm(p.gravity))
    x = ROUNDINGS * epsilon * size * (1.0 + n + p.h * p.h * stiffest) * growth * steps**2
    v = 2.0 * x / p.h + ROUNDINGS * epsilon * float(np.abs(p.velocities).max())
    return Rounding(float(x), float(v))


def relative_gap(
    p: SpringProblem, predicted: Mapping[str, Any], answered: Mapping[str, Any], allowed: Rounding
) -> float:
    """Return the largest difference of positions and velocities, over what they changed by.

    Rounding counts as no difference; so a number above SOLVED means another step. Velocities of
    pins are left out: they are nobody's.
    """
    gaps = [
        coordinate_gap(p, name, predicted[name], answered[name])
        / (np.abs(predicted[name] - before).max(initial=0.0) + getattr(allowed, name) / SOLVED)
        for name, before in (("positions", p.positions), ("velocities", 0.0))
        if name in answered
    ]
    return float(max(gaps)) if gaps and np.isfinite(gaps).all() else np.inf


def coordinate_gap(p: SpringProblem, name: str, expected: Any, answered: Any) -> float:
    """Return the largest difference of a coordinate, the velocities of pins left out."""
    gap = np.abs(np.asarray(expected) - np.asarray(answered))
    if name == "velocities":
        gap[..., p.pinned, :] = 0.0
    return float(gap.max(initial=0.0))


def correct_digits(gap: float, size: float) -> float:
    """Return how many digits of a number of this size are right, at most 16."""
    return float(np.clip(-np.log10(max(gap / size, 1e-16)), 0.0, 16.0))
