"""A small mass-spring system as dense arrays, with the changes that a wrong solver makes to it.

Its forces are written from the formulas, apart from `reference`: a spring pulls its first end with
-(k (l - r) + c (v_i - v_j)·u) u. A field states each deviation of a faulty solver.
"""

import dataclasses
from collections.abc import Callable, Mapping
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
    """The content of a request of a force, an energy or a step, as a solver reads it."""

    masses: FloatArray  # of inertia [kg], of some wrong solvers one for each component
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
    weighing: FloatArray  # the masses that gravity pulls [kg]
    weights: FloatArray  # the force of gravity [N], shape (particle, 3)
    late: FloatArray | None = None  # forces that act after the solve of a step only [N]
    h: float = 0.0  # time step [s]
    h_before: float = 0.0  # time step of the request before [s]
    steps: int | None = None  # number of steps, or None for a task of one step
    # the share of its force that a spring exerts on its first and on its second end
    ends: tuple[float, float] = (1.0, 1.0)
    # whether forces of springs at one particle add up; else the last one stays, of those whose
    # first end it is and of those whose second
    accumulated: bool = True
    # the velocity that dampers see: a key of RATES; the particle's own ("drag", "own whole"), or
    # its part along the spring ("own"); "one end": along the spring, felt by the first end alone
    damping: str = "along"
    normalised: bool = True  # whether a spring's direction is of length one
    # what takes the place of the length of springs, of their pull k (l - r), of the pull of dampers
    # c rate, and of the length at which dampers are at rest in an implicit step
    length: "Rule | None" = None
    pull: "Rule | None" = None
    damper_pull: "Rule | None" = None
    damper_rest: "Rule | None" = None
    # positions and velocities at the end of the last request of as many particles, if there is any
    before: tuple[FloatArray, FloatArray] | None = None
    linear: "SpringProblem | None" = None  # whose springs the matrix of a step has, if others
    merit: "SpringProblem | None" = None  # whose energy a line search compares, if another

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.masses)

    @property
    def inertia(self) -> FloatArray:
        """The masses as a column, or as three of them."""
        return self.masses if self.masses.ndim == 2 else self.masses[:, None]

    @property
    def inertia_diagonal(self) -> FloatArray:
        """The mass of each coordinate, shape (3 * particle,)."""
        return np.broadcast_to(self.inertia, (self.count, 3)).ravel()

    @cached_property
    def incidence(self) -> FloatArray:
        """Rows with 1 at a spring's first end and -1 at its second, shape (spring, particle)."""
        identity = np.eye(self.count)
        return identity[self.springs[:, 0]] - identity[self.springs[:, 1]]

    @cached_property
    def pulled(self) -> FloatArray:
        """The incidence with the ends that the springs pull, shape (spring, particle)."""
        rows = self.incidence * np.where(self.incidence > 0.0, *self.ends)
        if not self.accumulated:
            for row, (first, second) in enumerate(self.springs):
                later = self.springs[row + 1 :]
                rows[row, first] *= first not in later[:, 0]
                rows[row, second] *= second not in later[:, 1]
        return rows

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


# A formula of a problem, and of values by their names.
Rule = Callable[..., FloatArray]
_NUMBERS = ("masses", "rest_lengths", "stiffnesses", "dampings", "gravity", "positions")


def problem_of(inputs: Mapping[str, Any], h_before: float | None = None) -> SpringProblem:
    """Return the problem that a request states; the velocities of pins count as zero."""
    velocities = np.array(inputs["velocities"], dtype=float)
    pinned = np.asarray(inputs.get("pinned", ()), dtype=int)
    velocities[pinned] = 0.0
    springs = np.asarray(inputs["springs"], dtype=int).reshape(-1, 2)
    h = float(inputs.get("h", 0.0))
    numbers: dict[str, Any] = {name: np.asarray(inputs[name], dtype=float) for name in _NUMBERS}
    return SpringProblem(
        **numbers,
        springs=springs,
        velocities=velocities,
        pinned=pinned,
        tension_only=np.asarray(inputs.get("tension_only", np.zeros(len(springs))), dtype=bool),
        external=np.asarray(inputs.get("external_forces", np.zeros_like(velocities)), dtype=float),
        weighing=numbers["masses"],
        weights=numbers["masses"][:, None] * numbers["gravity"],
        h=h,
        h_before=h if h_before is None else h_before,
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
    if p.length is not None:
        length = p.length(p, l=length, d=d)
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
    length, u = frames(p, x)
    pull = p.stiffnesses * stretches(p, length) * (1.0 if p.normalised else length)
    if p.pull is not None:
        pull = p.pull(p, l=length, x=x)
    return -p.pulled.T @ (pull[:, None] * u)


def along(v: FloatArray, u: FloatArray) -> FloatArray:
    """Return the part of velocities v along directions u, shape (spring, 3)."""
    return (v * u).sum(axis=1, keepdims=True) * u


# The rate that a damper multiplies by c, from the velocities of both ends and the direction.
RATES: Mapping[str, Callable[[FloatArray, FloatArray, FloatArray], FloatArray]] = {
    "along": lambda v_i, v_j, u: along(v_i - v_j, u),
    "one end": lambda v_i, v_j, u: along(v_i - v_j, u),
    "all": lambda v_i, v_j, u: v_i - v_j,
    "sum": lambda v_i, v_j, u: along(v_i + v_j, u),
    "first": lambda v_i, v_j, u: along(v_i, u),
    "second": lambda v_i, v_j, u: along(-v_j, u),
    "speed": lambda v_i, v_j, u: np.linalg.norm(v_i - v_j, axis=1, keepdims=True) * u,
    "of all": lambda v_i, v_j, u: ((v_i - v_j) * u).sum() * u,
    "components": lambda v_i, v_j, u: (v_i - v_j) * np.abs(u),
}


def damper_forces(p: SpringProblem, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return the dampers' forces at velocities v on the particles [N], shape (particle, 3)."""
    if not p.damped:
        return np.zeros_like(x)
    if p.damping == "drag":
        return -p.dampings[0] * v
    c, (length, u) = p.dampings[:, None], frames(p, x)
    first, second = v[p.springs[:, 0]], v[p.springs[:, 1]]
    if p.damping in ("own", "own whole"):
        parts = [along(w, u) if p.damping == "own" else w for w in (first, second)]
        own = np.maximum(p.pulled, 0.0).T @ (c * parts[0])
        return -own - np.maximum(-p.pulled, 0.0).T @ (c * parts[1])
    if p.damper_pull is not None:
        rate = ((first - second) * u).sum(axis=1)
        return -p.pulled.T @ (p.damper_pull(p, l=length, rate=rate)[:, None] * u)
    pulled = np.maximum(p.pulled, 0.0) if p.damping == "one end" else p.pulled
    return -pulled.T @ (c * RATES[p.damping](first, second, u))


def all_forces(p: SpringProblem) -> FloatArray:
    """Return springs, dampers, gravity and external forces on the particles, (particle, 3) [N]."""
    x, v = p.positions, p.velocities
    return p.constant + spring_forces(p, x) + damper_forces(p, x, v)


def accelerations(p: SpringProblem, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return M^-1 f, pins included, shape (particle, 3) [m/s^2]."""
    total = p.constant + damper_forces(p, x, v)
    return (total + spring_forces(p, x) if p.stiff else total) / p.inertia


def elastic_energy(p: SpringProblem) -> float:
    """Return the energy of the springs [J]."""
    length, _ = frames(p, p.positions)
    return float((0.5 * p.stiffnesses * stretches(p, length) ** 2).sum())
