"""A step of every model that a solver may declare, dense.

An implicit step seeks x with M (x - y) = h² f(x), y = x_n + h v_n; with f = -grad E that is the
minimum of g(x) = 1/2 (x - y)' M (x - y) + h² E(x) (Liu et al. 2013). Everything is a dense array of
NumPy, for up to some thirty particles; only the minimum itself is sought by `reference`.
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import islice, repeat
from typing import NamedTuple

import numpy as np

from plumbob.reference import mass_spring
from plumbob.reference.arguments import SMALLEST_POSITIVE, BoolArray, FloatArray
from plumbob.reference.implicit_euler import ImplicitEuler

from .problem import SpringProblem, accelerations, damper_forces, frames, spring_forces, stretches

# From near a solution Newton's method squares the distance: three iterations end in rounding.
NEAR_ITERATIONS = 3
# The dampers at the end velocities differ little from those of a minimum, where it begins.
ITERATIONS = 20
# The mass of pins that fall freely within a solve [kg]: springs accelerate them no more.
FALLING_MASS = 1e10


class Integrator(NamedTuple):
    """How positions follow from the state at the start of a step."""

    # explicit, symplectic, positions_first (symplectic, x' = x + h v before v' = v + h f(x') / m),
    # taylor (x + h v + h²/2 a), runge_kutta; newton, local_global, converged
    method: str
    start: str = "x_n"  # of the iterations, "x_n", "y" or "s_n"
    iterations: int = 1
    hessian: str = "exact"  # of Newton's method: a key of HESSIANS

    @property
    def explicit(self) -> bool:
        """Whether no equation is solved."""
        return self.method in EXPLICIT


class Scaling(NamedTuple):
    """A factor of every velocity in each substep, and its place.

    The place is "start", of the old velocities before all else; "middle", of the new ones before
    they move positions, or of the old ones when they have; or "end", after all else.
    """

    factor: float = 1.0
    place: str = "end"


class StepModel(NamedTuple):
    """A complete description of an honest step."""

    integrator: Integrator = Integrator("converged", "y")  # of the positions
    substeps: int = 1  # equal steps that make up h
    # none, explicit, length_rate, end_velocity; matrix: implicit, beside explicit springs
    damper: str = "length_rate"
    scaling: Scaling = Scaling()
    # eliminated, overwritten; falling: overwritten, after a solve in which they fall freely; with a
    # number: penalty (weight), springs (stiffness), heavy, or weightless (heavy, but not pulled by
    # gravity)
    pins: str = "eliminated"
    velocity: str = "displacement"  # or separate

    @property
    def pin_kind(self) -> str:
        """The first word of `pins`."""
        return self.pins.split()[0]

    @property
    def pin_strength(self) -> float:
        """The weight of a penalty, the stiffness of springs to the pins or their mass."""
        return float(self.pins.split()[-1])

    @property
    def holds_pins(self) -> bool:
        """Whether pins are at the end exactly where they were."""
        return self.pins in ("eliminated", "overwritten", "falling")


class Substep(NamedTuple):
    """The state at the start of a substep, and its length."""

    p: SpringProblem
    model: StepModel
    x: FloatArray
    v: FloatArray
    h: float
    # positions that may be the solution, from which an equation is solved; None if unknown
    near: FloatArray | None = None

    @property
    def free(self) -> BoolArray:
        """Which particles the step may move, shape (particle, 1)."""
        is_free = np.ones((self.p.count, 1), dtype=bool)
        if self.model.pins == "eliminated":
            is_free[self.p.pinned] = False
        return is_free


State = tuple[FloatArray, FloatArray]  # positions and velocities


def simulate(
    p: SpringProblem, model: StepModel, near: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return positions and velocities after the step, or after each of several.

    Where `near` holds positions that may be those of each frame, equations are solved from them.
    """
    p = _with_pins(p, model)
    if model.integrator.explicit and model.damper == "none":
        p = p.changed(dampings=np.zeros_like(p.dampings))
    is_near = near is not None and np.isfinite(near).all() and model.substeps == 1
    targets: Iterator[FloatArray | None] = repeat(None, p.steps or 1)
    if near is not None and is_near and model.pins not in ("overwritten", "falling"):
        targets = iter(near.reshape(-1, p.count, 3))
    x, v, states = p.positions, p.velocities, []
    for target in targets:
        for _ in range(model.substeps):
            x, v = substep(Substep(p, model, x, v, p.h / model.substeps, target))
        states.append((x, v))
    X, V = map(np.array, zip(*states, strict=True))
    return {"positions": X, "velocities": V} if p.steps else {"positions": x, "velocities": v}


def predicted(
    p: SpringProblem, model: StepModel, near: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return the result of `simulate`, {} if the model's matrix is singular or numbers overflow."""
    with np.errstate(all="ignore"):
        try:
            return simulate(p, model, near)
        except (np.linalg.LinAlgError, ArithmeticError, ValueError):
            return {}


def _with_pins(p: SpringProblem, model: StepModel) -> SpringProblem:
    """Return the problem with the pins' masses and weights as the model has them."""
    masses, weights = p.masses.copy(), p.weights.copy()
    if model.pin_kind == "falling":
        masses[p.pinned], weights[p.pinned] = FALLING_MASS, FALLING_MASS * p.gravity
    elif model.pin_kind in ("heavy", "weightless"):
        masses[p.pinned] = model.pin_strength
        weights[p.pinned] *= model.pin_kind == "heavy"
    return p.changed(masses=masses, weights=weights)


def substep(start: Substep) -> State:
    """Return positions and velocities a time h later."""
    p, model, x_n, v_n, h, _ = start
    factor, place = model.scaling
    if place == "start":
        start = start._replace(v=factor * v_n)
    if model.integrator.explicit:
        x, v = EXPLICIT[model.integrator.method](start)
    else:
        equation = StepEquation(start)
        x = _implicit(equation)
        v = start.v + (x - equation.y - equation.gradient(x) / p.inertia) / h
    if model.velocity == "displacement":
        v = (x - x_n) / h
    if place == "end":
        v = factor * v
    if model.holds_pins:
        x, v = x.copy(), v.copy()
        x[p.pinned], v[p.pinned] = x_n[p.pinned], 0.0
    return x, v


def first_equation(p: SpringProblem, model: StepModel) -> "StepEquation":
    """Return the equation of the first substep."""
    p = _with_pins(p, model)
    return StepEquation(Substep(p, model, p.positions, p.velocities, p.h / model.substeps))


def _rates(start: Substep, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return accelerations with the damper that the model has, zero at the pins."""
    p, free = start.p, start.free
    a = np.where(free, accelerations(p, x, v), 0.0)
    if start.model.damper != "matrix":
        return a
    # (M + h C)^-1 M a
    _, u = frames(p, x)
    C = _assemble(p, p.dampings[:, None, None] * u[:, :, None] * u[:, None, :])
    return _solve(np.diag(np.repeat(p.masses, 3)) + start.h * C, p.inertia * a, free)


def _by_one_rate(start: Substep) -> State:
    """Step by one acceleration: explicit or symplectic Euler, or x + h v + h²/2 a.

    The force is at the start, or at the new positions where these come first.
    """
    model, x, v, h = start.model, start.x, start.v, start.h
    method, (factor, place) = model.integrator.method, model.scaling
    a = _rates(start, x + h * v if method == "positions_first" else x, v)
    factor = factor if place == "middle" else 1.0
    if method == "symplectic":
        v = factor * (v + h * a)
        return x + h * v, v
    share = 0.5 if method == "taylor" else 0.0
    return x + h * v + share * h * h * a, factor * v + h * a


def _runge_kutta(start: Substep) -> State:
    _, _, x, v, h, _ = start
    dx, dv = v, _rates(start, x, v)
    sum_x, sum_v = dx, dv
    for share, weight in ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        middle = x + share * h * dx, v + share * h * dv
        dx, dv = middle[1], _rates(start, *middle)
        sum_x, sum_v = sum_x + weight * dx, sum_v + weight * dv
    return x + h / 6 * sum_x, v + h / 6 * sum_v


EXPLICIT: Mapping[str, Callable[[Substep], State]] = {
    "explicit": _by_one_rate,
    "symplectic": _by_one_rate,
    "positions_first": _by_one_rate,
    "taylor": _by_one_rate,
    "runge_kutta": _runge_kutta,
}


class StepEquation:
    """M (x - y) - h² f(x) = 0 of a substep, and its derivative.

    A damper by the rate of length is a spring of stiffness c/h whose rest length is its length at
    the start. A penalty w of a pin is inertia: M + w seeks (M y + w x_n) / (M + w).
    """

    def __init__(self, start: Substep) -> None:
        """Set up y and the forces that stay through the step."""
        p, model, x, v, h, _ = start
        self.start, self.free, self.constant = start, start.free, p.constant
        self.y, self.inertia = x + h * v, p.inertia.copy()
        if model.damper == "explicit":
            self.constant = self.constant + damper_forces(p, x, v)
        is_implicit = p.damped and model.damper in ("length_rate", "end_velocity")
        by_length = model.damper == "length_rate" or model.integrator.method == "local_global"
        self.by_velocity = is_implicit and not by_length
        self.p = _with_damper_springs(p, x, h) if is_implicit and by_length else p
        if model.pin_kind in ("penalty", "springs"):
            scale = h * h if model.pin_kind == "springs" else 1.0
            self.inertia[p.pinned] += scale * model.pin_strength
        share = p.inertia / self.inertia
        self.target = share * self.y + (1.0 - share) * p.positions

    @property
    def starts(self) -> dict[str, FloatArray]:
        """Where iterations may begin; s_n = y + h² M⁻¹ f_ext (Bouaziz et al. 2014, Algorithm 1)."""
        fall = self.start.h**2 * self.constant / self.start.p.inertia
        return {"x_n": self.start.x, "y": self.y, "s_n": self.y + fall}

    @property
    def is_uncoupled(self) -> bool:
        """Whether no spring acts: s_n is the solution."""
        return not (self.p.stiff or self.by_velocity or self.start.p.pinned.size)

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return M (x - y) - h² f(x), shape (particle, 3)."""
        start, h = self.start, self.start.h
        f = self.constant + spring_forces(self.p, x)
        if self.by_velocity:
            f = f + damper_forces(start.p, x, (x - start.x) / h)
        return self.inertia * (x - self.target) - h * h * f

    def free_gradient(self, x: FloatArray) -> FloatArray:
        """Return the gradient, zero at particles that the step may not move."""
        return np.where(self.free, self.gradient(x), 0.0)

    def matrix(self, x: FloatArray, kind: str) -> FloatArray:
        """Return the matrix of a Newton step, (3 particle, 3 particle)."""
        p = self.p
        length, u = frames(p, x)
        k = np.where(p.tension_only & (length <= p.rest_lengths), 0.0, p.stiffnesses)
        across = HESSIANS[kind](p.rest_lengths / np.maximum(length, 1e-150))[:, None, None]
        uu = u[:, :, None] * u[:, None, :]
        blocks = k[:, None, None] * (across * np.eye(3) + (1.0 - across) * uu)
        if self.by_velocity:
            blocks = blocks + self._damper_blocks(x, kind, length, u)
        return self.with_inertia(blocks)

    def _damper_blocks(
        self, x: FloatArray, kind: str, length: FloatArray, u: FloatArray
    ) -> FloatArray:
        """Return c/h times the derivative of (w·u) u by w, the relative displacement, and by u."""
        p, uu = self.start.p, u[:, :, None] * u[:, None, :]
        c = (p.dampings / self.start.h)[:, None, None]
        if kind != "exact":
            return c * uu
        w, normal = p.incidence @ (x - self.start.x), np.eye(3) - uu
        w_normal = np.einsum("sab,sb->sa", normal, w)
        rotation = (w * u).sum(1)[:, None, None] * normal + u[:, :, None] * w_normal[:, None, :]
        return c * (uu + rotation / np.maximum(length, 1e-150)[:, None, None])

    def with_inertia(self, blocks: FloatArray) -> FloatArray:
        """Return M + h² times the sum of the blocks of springs."""
        A = self.start.h**2 * _assemble(self.p, blocks)
        A.flat[:: len(A) + 1] += np.repeat(self.inertia, blocks.shape[1])
        return A

    def solve(self, A: FloatArray, right: FloatArray) -> FloatArray:
        """Return A^-1 right over the free particles, zero elsewhere, shape (particle, ...)."""
        return _solve(A, right, self.free)


def _with_damper_springs(p: SpringProblem, x: FloatArray, h: float) -> SpringProblem:
    """Return the problem with each damper as a spring that has its rest length at x."""
    lengths, _ = frames(p, x)
    return p.changed(
        springs=np.concatenate([p.springs, p.springs]),
        rest_lengths=np.concatenate([p.rest_lengths, lengths]),
        stiffnesses=np.concatenate([p.stiffnesses, p.dampings / h]),
        dampings=np.zeros(2 * len(lengths)),
        tension_only=np.concatenate([p.tension_only, lengths < 0.0]),
    )


def _solve(A: FloatArray, right: FloatArray, is_free: BoolArray) -> FloatArray:
    """Return A^-1 right over the free particles, zero elsewhere, shape (particle, ...)."""
    free = np.repeat(is_free.ravel(), len(A) // len(right))
    solution, b = np.zeros_like(right).reshape(len(A), -1), right.reshape(len(A), -1)
    solution[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    return solution.reshape(right.shape)


# The share of a spring's stiffness across its direction, given r/l; along the spring the share is
# 1.
HESSIANS: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "exact": lambda ratio: 1.0 - ratio,
    "gauss": lambda ratio: 0.0 * ratio,
    "projected": lambda ratio: np.maximum(1.0 - ratio, 0.0),
}


def _assemble(p: SpringProblem, blocks: FloatArray) -> FloatArray:
    """Return the sum over springs of (A_i A_i') x block, (size particle, size particle)."""
    n, size = p.count, blocks.shape[1]
    right = (p.incidence[:, :, None, None] * blocks[:, None]).reshape(len(blocks), -1)
    sums = (p.incidence.T @ right).reshape(n, n, size, size)
    return np.ascontiguousarray(sums.transpose(0, 2, 1, 3)).reshape(size * n, size * n)


def _implicit(equation: StepEquation) -> FloatArray:
    """Return the positions at the end of an implicit step."""
    start, integrator = equation.start, equation.start.model.integrator
    if equation.is_uncoupled:
        return equation.starts["s_n"]
    if integrator.method == "converged":
        return _converged(equation)
    x = np.where(equation.free, equation.starts[integrator.start], start.x)
    return next(islice(ITERATES[integrator.method](equation, x), integrator.iterations, None))


def _converged(equation: StepEquation) -> FloatArray:
    """Return the solution near the given positions, else that of a search from y."""
    near = equation.start.near
    if near is not None:
        x, count = np.where(equation.free, near, equation.start.x), NEAR_ITERATIONS
    elif equation.by_velocity:
        model = equation.start.model._replace(damper="length_rate")
        x, count = _minimum(StepEquation(equation.start._replace(model=model))), ITERATIONS
    else:
        return _minimum(equation)
    return next(islice(_newton(equation, x), count, None))


def _minimum(equation: StepEquation) -> FloatArray:
    """Return the minimum of g that Newton's method of the reference finds from y."""
    p, free = equation.p, equation.free
    system = mass_spring.MassSpring(
        equation.inertia.ravel(), p.springs, p.rest_lengths, p.stiffnesses,
        pinned=np.flatnonzero(~free), gravity=np.zeros(3), tension_only=p.tension_only,
    )  # fmt: skip
    y = np.where(free, equation.target, equation.start.x)
    integrator = ImplicitEuler(system, h=equation.start.h, tolerance=SMALLEST_POSITIVE)
    step = integrator.step(mass_spring.State(y, np.zeros_like(y)), equation.constant)
    return np.array(step.state.positions)


def _newton(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    hessian = equation.start.model.integrator.hessian
    while True:
        yield x
        x = x - equation.solve(equation.matrix(x, hessian), equation.free_gradient(x))


def _local_global(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    """Solve (M + h²L) x_next = h² J d + M y + h² f_ext, pins moved to the right-hand side."""
    p, free, hh = equation.p, equation.free, equation.start.h**2
    A = equation.with_inertia(p.stiffnesses[:, None, None])
    fixed = equation.inertia * equation.target + hh * equation.constant
    fixed = fixed - A @ np.where(free, 0.0, x)
    inverse = equation.solve(A, np.eye(len(A)))
    while True:
        yield x
        length, u = frames(p, x)
        size = p.stiffnesses * (length - stretches(p, length))
        x = np.where(free, inverse @ (fixed + hh * (p.incidence.T @ (size[:, None] * u))), x)


# The iterates of a method from a start, without end.
ITERATES: Mapping[str, Callable[[StepEquation, FloatArray], Iterator[FloatArray]]] = {
    "newton": _newton,
    "local_global": _local_global,
}
