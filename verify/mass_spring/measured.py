"""Numbers of a step that answers show by their momentum, which springs and dampers conserve.

Without pins the centre of mass falls freely, in so many substeps and with such a factor of
velocities. What gravity adds and the free particles lack, the pins have: over their velocity it is
their mass, or it tells the penalty or the springs that hold them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from .problem import SpringProblem

# A problem, and the outputs of an answer to it.
SteppedAnswer = tuple[SpringProblem, Mapping[str, Any]]
# The most substeps that a greeting may declare.
MAX_SUBSTEPS = 1000
# Of methods of the second order a fall shows no number of substeps: it is one of these.
USUAL_SUBSTEPS = (2, 4, 5, 8, 10, 20)
# Where the share of h² g is nearer to 1/2 than this, the method is of the second order.
SECOND_ORDER = 1e-4
# A factor of velocities that no greeting declares lies in this range: below are other mistakes,
# above is what an iterative linear solver leaves.
LEAST_FACTOR, LARGEST_FACTOR = 0.9, 1.0 - 1e-6
# The least mass [kg] of pins that hold, and the share of their momentum that may be lost.
LEAST_MASS, ACCURACY = 1e2, 1e-2


def measured(answers: Sequence[SteppedAnswer], substeps: int | None) -> dict[str, list[Any]]:
    """Return substeps, factors and strengths of pins that answers to single steps show."""
    numbers: dict[str, list[Any]] = {}
    unpinned = [(p, outputs) for p, outputs in answers if not p.pinned.size]
    if unpinned:
        p, outputs = unpinned[0]
        numbers = {"substeps": _substeps(p, outputs), "factor": _factors(p, outputs, substeps)}
    pinned = [(p, outputs) for p, outputs in answers if p.pinned.size]
    for kind in ("heavy", "weightless", "penalty", "springs"):
        if strength := _strength(kind, pinned):
            numbers[kind] = [f"{strength:.4g}".replace("e+0", "e").replace("e+", "e")]
    return numbers


def _substeps(p: SpringProblem, outputs: Mapping[str, Any]) -> list[int]:
    """Return how many substeps may lead to the place of the centre of mass.

    It falls by (n + 1) / (2 n) of h² g in symplectic and implicit Euler, in explicit Euler by
    (n - 1) / (2 n).
    """
    fall = p.h**2 * p.shares @ (p.constant / p.inertia)
    if "positions" not in outputs or not fall.any():
        return []
    drift = p.shares @ (outputs["positions"] - p.positions - p.h * p.velocities)
    deviation = abs(2.0 * float(drift @ fall) / float(fall @ fall) - 1.0)
    if not deviation > SECOND_ORDER:
        return list(USUAL_SUBSTEPS)
    count = round(1.0 / deviation)
    return [count] if 1 < count <= MAX_SUBSTEPS else []


def _factors(p: SpringProblem, outputs: Mapping[str, Any], substeps: int | None) -> list[float]:
    """Return the factor of each substep by which the centre of mass slows across gravity."""
    g, v = p.shares @ (p.constant / p.inertia), p.shares @ p.velocities
    across = v - float(v @ g) / max(float(g @ g), 1e-300) * g
    end = outputs.get("velocities", (outputs.get("positions", p.positions) - p.positions) / p.h)
    share = float(p.shares @ end @ across) / max(float(across @ across), 1e-300)
    factor = max(share, 0.0) ** (1.0 / (substeps or 1))
    return [factor] if LEAST_FACTOR <= factor <= LARGEST_FACTOR else []


def _strength(kind: str, answers: Sequence[SteppedAnswer]) -> float | None:
    """Return the mass [kg], penalty [kg] or stiffness [N/m] of pins, None if no number fits all."""
    for name in ("velocities", "positions"):
        rows = [_momenta(kind, p, outputs, name) for p, outputs in answers if name in outputs]
        pull, momentum = np.array(rows).reshape(-1, 2, 3).swapaxes(0, 1).reshape(2, -1)
        square = float(pull @ pull)
        if not np.isfinite(rows).all() or square == 0.0:
            continue
        strength = float(pull @ momentum) / square
        is_exact = np.abs(pull * strength - momentum).max() <= ACCURACY * np.abs(momentum).max()
        scale = answers[0][0].h ** 2 if kind == "springs" else 1.0
        if is_exact and strength * scale >= LEAST_MASS:
            return strength
    return None


def _momenta(
    kind: str, p: SpringProblem, outputs: Mapping[str, Any], name: str
) -> tuple[FloatArray, FloatArray]:
    """Return the pins' momentum per unit of their strength, and that which they have [kg m/s]."""
    v = outputs[name] if name == "velocities" else (outputs[name] - p.positions) / p.h
    free = np.setdiff1d(np.arange(p.count), p.pinned)
    taken = p.h * p.constant[free].sum(0) - p.masses[free] @ (v - p.velocities)[free]
    if kind != "weightless":
        taken = taken + p.h * p.constant[p.pinned].sum(0)
    if kind in ("penalty", "springs"):
        taken = taken - p.masses[p.pinned] @ v[p.pinned]
    scale = p.h**2 if kind == "springs" else 1.0
    return scale * v[p.pinned].sum(0), taken
