"""A small mass-spring system as dense arrays.

Its forces are written from the formulas, without `reference`. A spring pulls its first end with -(k
(l - r) + c (v_i - v_j)·u) u.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.mass_spring import MassSpring, State

# Ends nearer than this [m] count as coincident: their direction is then (1, 0, 0).
COINCIDENT = 1e-150


@dataclass(frozen=True, eq=False)
class SpringProblem:
    """The content of a request of a force, an energy or a step."""

    masses: FloatArray  # [kg]
    springs: IndexArray
    rest_lengths: FloatArray
    stiffnesses: FloatArray
    dampings: FloatArray
    gravity: FloatArray  # acceleration [m/s^2], shape (3,)
    positions: FloatArray
    velocities: FloatArray
    pinned: IndexArray  # indices of pinned particles
    tension_only: Any  # a boolean, or one for each spring
    external: FloatArray  # forces besides gravity [N], shape (particle, 3)
    weights: FloatArray  # the force of gravity [N], shape (particle, 3)
    h: float = 0.0  # time step [s]
    steps: int | None = None  # number of steps, or None for a task of one step

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.masses)

    @property
    def inertia(self) -> FloatArray:
        """The masses as a column."""
        return self.masses[:, None]

    @cached_property
    def shares(self) -> FloatArray:
        """The share of each particle in the mass."""
        return np.asarray(self.masses / self.masses.sum())

    @cached_property
    def incidence(self) -> FloatArray:
        """Rows with 1 at a spring's first end and -1 at its second, shape (spring, particle)."""
        identity = np.eye(self.count)
        return identity[self.springs[:, 0]] - identity[self.springs[:, 1]]

    @cached_property
    def stiff(self) -> bool:
        """Whether any spring has a stiffness."""
        return bool(self.stiffnesses.any())

    @cached_property
    def damped(self) -> bool:
        """Whether any spring has a damper."""
        return bool(self.dampings.any())

    @cached_property
    def constant(self) -> FloatArray:
        """Gravity and external forces [N], shape (particle, 3)."""
        return self.weights + self.external

    def changed(self, **fields: Any) -> "SpringProblem":
        """Return the problem with other fields."""
        return dataclasses.replace(self, **fields)


_NUMBERS = ("masses", "rest_lengths", "stiffnesses", "dampings", "gravity", "positions")


def problem_of(inputs: Mapping[str, Any]) -> SpringProblem:
    """Return the problem that a request states; the velocities of pins count as zero."""
    velocities = np.array(inputs["velocities"], dtype=float)
    pinned = np.asarray(inputs.get("pinned", ()), dtype=int)
    velocities[pinned] = 0.0
    springs = np.asarray(inputs["springs"], dtype=int).reshape(-1, 2)
    numbers: dict[str, Any] = {name: np.asarray(inputs[name], dtype=float) for name in _NUMBERS}
    return SpringProblem(
        **numbers,
        springs=springs,
        velocities=velocities,
        pinned=pinned,
        tension_only=np.asarray(inputs.get("tension_only", np.zeros(len(springs))), dtype=bool),
        external=np.asarray(inputs.get("external_forces", np.zeros_like(velocities)), dtype=float),
        weights=numbers["masses"][:, None] * numbers["gravity"],
        h=float(inputs.get("h", 0.0)),
        steps=inputs.get("steps"),
    )


def system_of(p: SpringProblem) -> MassSpring:
    """Return the same system for `reference`."""
    return MassSpring(
        p.masses, p.springs, p.rest_lengths, p.stiffnesses, p.dampings, p.pinned, p.gravity,
        p.tension_only,
    )  # fmt: skip


def state_of(p: SpringProblem) -> State:
    """Return the same state for `reference`."""
    return State(p.positions, p.velocities)


def frames(p: SpringProblem, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the length of each spring and its direction from the second end to the first."""
    d = x[p.springs[:, 0]] - x[p.springs[:, 1]]
    length = np.sqrt((d * d).sum(axis=1))
    if length.min(initial=1.0) > COINCIDENT:
        return length, d / length[:, None]
    u = np.where(
        length[:, None] > COINCIDENT, d / np.maximum(length, COINCIDENT)[:, None], (1.0, 0.0, 0.0)
    )
    return length, u


def stretches(p: SpringProblem, length: FloatArray) -> FloatArray:
    """Return l - r, zero for a slack spring."""
    stretch = length - p.rest_lengths
    return np.where(p.tension_only & (stretch < 0.0), 0.0, stretch)


def spring_forces(p: SpringProblem, x: FloatArray) -> FloatArray:
    """Return the springs' forces on the particles [N], shape (particle, 3)."""
    if not p.stiff:
        return np.zeros_like(x)
    length, u = frames(p, x)
    return -p.incidence.T @ ((p.stiffnesses * stretches(p, length))[:, None] * u)


def damper_forces(p: SpringProblem, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return the dampers' forces at velocities v on the particles [N], shape (particle, 3)."""
    if not p.damped:
        return np.zeros_like(x)
    _, u = frames(p, x)
    rate = ((p.incidence @ v) * u).sum(axis=1)
    return -p.incidence.T @ ((p.dampings * rate)[:, None] * u)


def all_forces(
    p: SpringProblem, x: FloatArray | None = None, v: FloatArray | None = None
) -> FloatArray:
    """Return springs, dampers, gravity and external forces on the particles, (particle, 3) [N]."""
    x, v = p.positions if x is None else x, p.velocities if v is None else v
    return p.constant + spring_forces(p, x) + damper_forces(p, x, v)


def accelerations(p: SpringProblem, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return M^-1 f, pins included, shape (particle, 3) [m/s^2]."""
    return all_forces(p, x, v) / p.inertia


def elastic_energy(p: SpringProblem) -> float:
    """Return the energy of the springs [J]."""
    length, _ = frames(p, p.positions)
    return float((0.5 * p.stiffnesses * stretches(p, length) ** 2).sum())
