"""One step of every model that a solver may declare, and of the faults that occur in them, dense.

An implicit step seeks x with M (x - y) = h² f(x), y = x_n + h v_n; with f = -grad E that is the
minimum of g(x) = 1/2 (x - y)' M (x - y) + h² E(x) (Liu et al. 2013). Everything is a dense array of
NumPy, for up to some thirty particles, and independent of the solvers of `reference`.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray

from .problem import (
    SpringProblem,
    accelerations,
    damper_forces,
    frames,
    spring_forces,
    stretches,
)

# Newton's method ends in rounding long before this on systems of this size.
MOST_ITERATIONS = 200
# Stiffness of springs to the pins, weight of a penalty, and mass of heavy pins.
PIN_STRENGTHS: Mapping[str, float] = {
    f"{kind} {strength}": float(strength)
    for kind, strengths in {
        "penalty": ("1e10", "1e8", "1e6"),
        "springs": ("1e6", "5e5", "1e5"),
        "heavy": ("1e10", "1e8", "1e6"),
        "falling": ("1e10", "1e8", "1e6"),
    }.items()
    for strength in strengths
} | {"one kilogram": 1.0}


class Integrator(NamedTuple):
    """How positions follow from the state at the start of a step."""

    # explicit, symplectic, taylor (x + h v + h²/2 a), runge_kutta; newton, local_global, descent
    # (along the gradient), converged
    method: str
    start: str = "x_n"  # of the iterations, "x_n" or "y"
    iterations: int = 1  # how many
    # of Newton's method: exact; gauss: without geometric term; projected: that term only where it
    # pulls; flipped: its sign turned; transverse: nothing but that term; frozen: exact at x_n
    hessian: str = "exact"
    rate: float = 1.0  # by what the step of Newton's method or the gradient is multiplied

    @property
    def explicit(self) -> bool:
        """Whether no equation is solved."""
        return self.method in EXPLICIT


class StepModel(NamedTuple):
    """A complete description of a step, honest or not."""

    integrator: Integrator = Integrator("converged", "y")  # of the positions
    substeps: int = 1  # equal steps that make up h
    # none, explicit, length_rate, end_velocity; implicit in diag(C), in C's 3 x 3 blocks, or in C,
    # beside explicit springs: diagonal, blocks, matrix
    damper: str = "length_rate"
    scaling: float = 1.0  # of every velocity after each substep
    # eliminated, overwritten, a key of PIN_STRENGTHS; at_the_end: free through the substeps; free;
    # unattached: no springs to them; first: only one is held; origin: their columns dropped, so
    # that springs end at the origin
    pins: str = "eliminated"
    velocity: str = "displacement"  # displacement, separate; or a key of VELOCITIES
    matrix: str = "M+h²L"  # of an implicit step: a key of MATRICES
    # what stands for y: y; x_n: no velocity; doubled: x_n + 2 h v; squared: x_n + h² v
    inertia: str = "y"
    # divided among substeps; undivided; before: of the last request, in the matrix only; or a
    # number of seconds instead of h
    time: str | float = "divided"


class Matrix(NamedTuple):
    """How the system matrix is put together from masses and springs."""

    masses: float = 1.0  # how many times M is added
    power: int = 2  # of h before the springs' part, with its sign
    sign: float = 1.0
    stiffness: bool = True  # whether the springs' part has its factor k
    beside: float = 1.0  # by what the entries off the diagonal are multiplied


MATRICES: Mapping[str, Matrix] = {
    "M+h²L": Matrix(),
    "L": Matrix(masses=0.0),
    "L without h²": Matrix(masses=0.0, power=0),
    "M+hL": Matrix(power=1),
    "M+L": Matrix(power=0),
    "M-h²L": Matrix(sign=-1.0),
    "without k": Matrix(stiffness=False),
    "without k, minus": Matrix(stiffness=False, sign=-1.0),
    "doubled beside": Matrix(beside=2.0),
    "positive beside": Matrix(beside=-1.0),
    "diagonal": Matrix(beside=0.0),
    "M": Matrix(sign=0.0),
    "2M+h²L": Matrix(masses=2.0),
}


class Start(NamedTuple):
    """What a substep starts from."""

    p: SpringProblem
    model: StepModel
    x: FloatArray
    v: FloatArray
    h: float

    @property
    def free(self) -> BoolArray:
        """Which particles the step may move."""
        free = np.ones(self.p.count, dtype=bool)
        if self.model.pins in ("eliminated", "unattached", "first", "origin"):
            free[self.p.pinned] = False
        return free


def simulate(p: SpringProblem, model: StepModel) -> dict[str, FloatArray]:
    """Return positions and velocities after the step, or after each of several."""
    p = _with_pins(p, model)
    if model.integrator.explicit and model.damper == "none":
        p = p.changed(dampings=np.zeros_like(p.dampings))
    x, v, states = p.positions, p.velocities, []
    for _ in range(p.steps or 1):
        x, v = _step(p, model, x, v)
        states.append((x, v))
    if p.steps is None:
        return {"positions": x, "velocities": v}
    positions, velocities = map(np.array, zip(*states, strict=True))
    return {"positions": positions, "velocities": velocities}


def predicted(p: SpringProblem, model: StepModel) -> dict[str, FloatArray]:
    """Return the model's result, {} if its matrix is singular."""
    with np.errstate(all="ignore"):
        try:
            return simulate(p, model)
        except np.linalg.LinAlgError:
            return {}


def _with_pins(p: SpringProblem, model: StepModel) -> SpringProblem:
    """Return the problem with the pins' masses, springs or number as the model has them."""
    kind, pinned = model.pins.split()[0], p.pinned
    if kind in ("heavy", "falling", "one"):
        masses = p.masses.copy()
        masses[pinned] = PIN_STRENGTHS[model.pins]
        return p.changed(masses=masses, weighing=p.weighed if kind == "heavy" else masses)
    if kind == "unattached":
        kept = ~np.isin(p.springs, pinned).any(axis=1)
        return p.changed(stiffnesses=kept * p.stiffnesses, dampings=kept * p.dampings)
    return p.changed(pinned=pinned[: {"first": 1, "free": 0}.get(kind)])


def _step(
    p: SpringProblem, model: StepModel, x: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray]:
    whole = p.h if isinstance(model.time, str) else model.time
    h = whole if model.time == "undivided" else whole / model.substeps
    pins = x[p.pinned]
    for _ in range(model.substeps):
        x, v = substep(Start(p, model, x, v, h))
    if model.pins == "at_the_end":
        x, v = x.copy(), v.copy()
        x[p.pinned], v[p.pinned] = pins, 0.0
    return x, v


def substep(start: Start) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities a time h later."""
    p, model, x_n, natural, h = start
    if model.integrator.explicit:
        x, natural = EXPLICIT[model.integrator.method](start)
    else:
        equation = Equation(start)
        x = _implicit(equation)
        if model.velocity == "separate":
            force = x - equation.y - equation.gradient(x) / p.masses[:, None]
            natural = natural + force / h
    v = VELOCITIES[model.velocity](start, x, natural) * model.scaling
    if model.pins == "overwritten" or not start.free.all():
        x, v = x.copy(), v.copy()
        x[p.pinned], v[p.pinned] = x_n[p.pinned], 0.0
    return x, v


def _explicit_rates(start: Start, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return accelerations with the damper that the model has, zero at the pins."""
    p, model = start.p, start.model
    a = accelerations(p, x, v)
    kind = model.pins.split()[0]
    if kind in ("penalty", "springs"):
        held = PIN_STRENGTHS[model.pins] * (p.positions - x)[p.pinned]
        a[p.pinned] += held / p.masses[p.pinned, None]
    a[~start.free] = 0.0
    return _damper_implicit(start, x, a)


def _damper_implicit(start: Start, x: FloatArray, a: FloatArray) -> FloatArray:
    """Return a, or (M + h D)^-1 M a with the part D of C that the model treats implicitly."""
    p, part = start.p, start.model.damper
    if part not in ("diagonal", "blocks", "matrix"):
        return a
    _, u = frames(p, x)
    C = _assemble(p, p.dampings[:, None, None] * u[:, :, None] * u[:, None, :])
    n = p.count
    if part == "diagonal":
        C = np.diag(np.diag(C))
    elif part == "blocks":
        C = C * np.kron(np.eye(n), np.ones((3, 3)))
    M, free = np.repeat(p.masses, 3), np.repeat(start.free, 3)
    solved = np.zeros(3 * n)
    A = (np.diag(M) + start.h * C)[np.ix_(free, free)]
    solved[free] = np.linalg.solve(A, (M * a.ravel())[free])
    return solved.reshape(n, 3)


def _by_one_rate(start: Start) -> tuple[FloatArray, FloatArray]:
    """Step by the acceleration at the start: explicit or symplectic Euler, or x + h v + h²/2 a."""
    _, model, x, v, h = start
    a = _explicit_rates(start, x, v)
    share = {"explicit": 0.0, "taylor": 0.5, "symplectic": 1.0}[model.integrator.method]
    return x + h * (v + share * h * a), v + h * a


def _runge_kutta(start: Start) -> tuple[FloatArray, FloatArray]:
    _, _, x, v, h = start
    dx, dv = v, _explicit_rates(start, x, v)
    sum_x, sum_v = dx, dv
    for share, weight in ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        middle = x + share * h * dx, v + share * h * dv
        dx, dv = middle[1], _explicit_rates(start, *middle)
        sum_x, sum_v = sum_x + weight * dx, sum_v + weight * dv
    return x + h / 6 * sum_x, v + h / 6 * sum_v


def _in_place(start: Start) -> tuple[FloatArray, FloatArray]:
    """Move one particle after another, each seeing those before it at their new places."""
    _, _, x, v, h = start
    x, v = x.copy(), v.copy()
    for i in range(len(x)):
        v[i] += h * _explicit_rates(start, x, v)[i]
        x[i] += h * v[i]
    return x, v


EXPLICIT: Mapping[str, Callable[[Start], tuple[FloatArray, FloatArray]]] = {
    "explicit": _by_one_rate,
    "symplectic": _by_one_rate,
    "taylor": _by_one_rate,
    "runge_kutta": _runge_kutta,
    "in_place": _in_place,
}


def _old_forces(start: Start, x: FloatArray, natural: FloatArray) -> FloatArray:
    rates = accelerations(start.p, start.x, start.v)
    return start.v + start.h * np.where(start.free[:, None], rates, 0.0)


VELOCITIES: Mapping[str, Callable[[Start, FloatArray, FloatArray], FloatArray]] = {
    "displacement": lambda s, x, natural: (x - s.x) / s.h,
    "separate": lambda s, x, natural: natural,
    "old forces": _old_forces,
    "kept": lambda s, x, natural: s.v,
    "over 2h": lambda s, x, natural: (x - s.x) / (2.0 * s.h),
    "over h²": lambda s, x, natural: (x - s.x) / s.h**2,
    "not divided": lambda s, x, natural: x - s.x,
    "over the whole h": lambda s, x, natural: (x - s.x) / s.p.h,
    "with the old": lambda s, x, natural: s.v + (x - s.x) / s.h,
    "averaged": lambda s, x, natural: 0.5 * (s.v + (x - s.x) / s.h),
    "from y": lambda s, x, natural: (x - s.x) / s.h - s.v,
    "zero": lambda s, x, natural: np.zeros_like(s.v),
    "backwards": lambda s, x, natural: (s.x - x) / s.h,
}


class Equation:
    """M (x - y) - h² f(x) = 0 of a substep, its derivative and, where it has one, g."""

    def __init__(self, start: Start) -> None:
        """Set up y and the forces that stay through the step."""
        p, model, x, v, h = start
        self.start, self.free = start, start.free
        shift = {"y": h * v, "x_n": 0.0 * v, "doubled": 2.0 * h * v, "squared": h * h * v}
        self.y = x + shift[model.inertia]
        self.constant = p.constant
        if model.damper == "explicit":
            self.constant = self.constant + damper_forces(p, x, v)
        self.damped = model.damper in ("length_rate", "end_velocity") and bool(p.dampings.any())
        self.by_length = model.damper == "length_rate" and p.damping == "along"
        self.pins = p.pinned if model.pins.split()[0] in ("penalty", "springs") else p.pinned[:0]
        self.hold = PIN_STRENGTHS.get(model.pins, 0.0)
        if model.pins.startswith("springs"):
            self.hold *= h * h
        self.conservative = (
            p.ends == (1.0, 1.0)
            and p.accumulated
            and p.normalised
            and (self.by_length or not self.damped)
        )

    @property
    def uncoupled(self) -> bool:
        """Whether no spring acts and the matrix is M: one Newton step arrives."""
        p, model = self.start.p, self.start.model
        return not (p.stiff or self.damped or len(self.pins)) and model.matrix == "M+h²L"

    @cached_property
    def length_n(self) -> FloatArray:
        """Length of each spring at the start."""
        return frames(self.start.p, self.start.x)[0]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return M (x - y) - h² f(x), shape (particle, 3)."""
        p, h = self.start.p, self.start.h
        f = self.constant + spring_forces(p, x)
        if self.damped and self.by_length:
            length, u = frames(p, x)
            rate = (length - self.length_n) / h
            f = f - p.pulled.T @ ((p.dampings * rate)[:, None] * u)
        elif self.damped:
            f = f + damper_forces(p, x, (x - self.start.x) / h)
        result = p.masses[:, None] * (x - self.y) - h * h * f
        result[self.pins] += self.hold * (x - p.positions)[self.pins]
        return result

    def free_gradient(self, x: FloatArray) -> FloatArray:
        """Return the gradient, zero at what the step may not move."""
        return np.where(self.free[:, None], self.gradient(x), 0.0)

    def value(self, x: FloatArray) -> float:
        """Return g(x)."""
        p, h = self.start.p, self.start.h
        length, _ = frames(p, x)
        energy = 0.5 * (p.stiffnesses * stretches(p, length) ** 2).sum()
        if self.damped:
            energy += 0.5 / h * (p.dampings * (length - self.length_n) ** 2).sum()
        held = 0.5 * self.hold * ((x - p.positions)[self.pins] ** 2).sum()
        inertia = 0.5 * (p.masses[:, None] * (x - self.y) ** 2).sum()
        return float(inertia + h * h * (energy - (self.constant * x).sum()) + held)

    def blocks(self, x: FloatArray, kind: str) -> FloatArray:
        """Return each spring's 3 x 3 stiffness with its damper's, shape (spring, 3, 3)."""
        p, h = self.start.p, self.start.h
        length, u = frames(p, x)
        k = p.stiffnesses
        if not MATRICES[self.start.model.matrix].stiffness:
            k = np.ones_like(k)
        k = np.where(p.tension_only & (length <= p.rest_lengths), 0.0, k)
        safe = np.maximum(length, 1e-150)
        across = TRANSVERSE[kind](1.0 - p.rest_lengths / safe)
        uu = u[:, :, None] * u[:, None, :]
        along = 0.0 if kind == "transverse" else 1.0
        total = _isotropic(k * across) + (k * (along - across))[:, None, None] * uu
        if not self.damped:
            return total
        c = p.dampings / h
        if self.by_length:
            across = TRANSVERSE[kind](1.0 - self.length_n / safe)
            return total + _isotropic(c * across) + (c * (1.0 - across))[:, None, None] * uu
        return total + c[:, None, None] * self._velocity_blocks(x, u, safe, kind)

    def _velocity_blocks(
        self, x: FloatArray, u: FloatArray, length: FloatArray, kind: str
    ) -> FloatArray:
        """Return the derivative of ((w·u) u), w the relative displacement, for each spring."""
        p = self.start.p
        if p.damping != "along":
            return _isotropic(np.ones(len(u)))
        uu = u[:, :, None] * u[:, None, :]
        if kind != "exact":
            return uu
        w = p.incidence @ (x - self.start.x)
        normal = np.eye(3) - uu
        w_normal = np.einsum("sab,sb->sa", normal, w)
        turning = (w * u).sum(1)[:, None, None] * normal + u[:, :, None] * w_normal[:, None, :]
        return uu + turning / length[:, None, None]

    def matrix(self, x: FloatArray, kind: str) -> FloatArray:
        """Return the matrix of a Newton step, (3 particle, 3 particle), as the model has it."""
        blocks = self.blocks(x, kind)
        A = self.put_together(_assemble(self.start.p, blocks), 3)
        held = np.repeat(self.pins, 3) * 3 + np.tile(np.arange(3), len(self.pins))
        A[held, held] += self.hold
        return A

    def put_together(self, springs: FloatArray, size: int) -> FloatArray:
        """Return M + h² times the springs' part, or what a faulty solver makes of it."""
        p, model = self.start.p, self.start.model
        how = MATRICES[model.matrix]
        h = p.h_before / model.substeps if model.time == "before" else self.start.h
        if how.beside != 1.0:
            cells = np.kron(np.eye(p.count), np.ones((size, size)))
            springs = np.where(cells, springs, how.beside * springs)
        masses = how.masses * np.repeat(p.masses, size)
        return how.sign * h**how.power * springs + np.diag(masses)

    def solve(self, A: FloatArray, right: FloatArray) -> FloatArray:
        """Return A^-1 right over the free particles, zero elsewhere, shape (particle, 3)."""
        size = len(A) // len(right)
        free = np.repeat(self.free, size)
        result = np.zeros_like(right).reshape(len(A), -1)
        part = A if free.all() else A[np.ix_(free, free)]
        result[free] = np.linalg.solve(part, right.reshape(len(A), -1)[free])
        return result.reshape(right.shape)


# What a kind of Hessian makes of 1 - r/l, the share of the stiffness that acts across a spring.
TRANSVERSE: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "gauss": lambda share: 0.0 * share,
    "projected": lambda share: np.maximum(share, 0.0),
    "flipped": lambda share: -share,
} | dict.fromkeys(("exact", "frozen", "transverse"), lambda share: share)


def _isotropic(scale: FloatArray) -> FloatArray:
    return scale[:, None, None] * np.eye(3)


def _assemble(p: SpringProblem, blocks: FloatArray) -> FloatArray:
    """Return the sum over springs of (A_i A_i') x block, (3 particle, 3 particle)."""
    n = p.count
    right = (p.incidence[:, :, None, None] * blocks[:, None]).reshape(len(blocks), -1)
    sums = (p.pulled.T @ right).reshape(n, n, 3, 3)
    return np.ascontiguousarray(sums.transpose(0, 2, 1, 3)).reshape(3 * n, 3 * n)


def _implicit(equation: Equation) -> FloatArray:
    """Return the positions at the end of an implicit step."""
    start = equation.start
    how = start.model.integrator
    x = np.where(equation.free[:, None], equation.y if how.start == "y" else start.x, start.x)
    if equation.uncoupled and how.method != "descent":
        p, h = start.p, start.h
        best = equation.y + h * h * equation.constant / p.masses[:, None]
        left = (1.0 - how.rate) ** how.iterations
        return np.where(equation.free[:, None], best + left * (x - best), x)
    return _METHODS[how.method](equation, x, how)


def _newton(equation: Equation, x: FloatArray, how: Integrator) -> FloatArray:
    for _ in range(how.iterations):
        at = equation.start.x if how.hessian == "frozen" else x
        step = equation.solve(equation.matrix(at, how.hessian), equation.gradient(x))
        x = x - how.rate * step
    return x


def _local_global(equation: Equation, x: FloatArray, how: Integrator) -> FloatArray:
    """Solve (M + h²L) x_next = h² J d + M y + h² f_ext, pins moved to the right-hand side."""
    start = equation.start
    p, h = start.p, start.h
    k, c = p.stiffnesses, (p.dampings / h if equation.damped else 0.0 * p.dampings)
    known = MATRICES[start.model.matrix].stiffness
    weights = (k if known else np.ones_like(k)) + c
    A = equation.put_together(p.pulled.T @ (weights[:, None] * p.incidence), 1)
    A[equation.pins, equation.pins] += equation.hold
    held = np.where(equation.free[:, None], 0.0, x)
    if start.model.pins == "origin":
        held = 0.0 * held
    for _ in range(how.iterations):
        length, u = frames(p, x)
        rest = np.where(p.tension_only & (length < p.rest_lengths), length, p.rest_lengths)
        rest = rest if p.normalised else rest * length
        pull = (k * rest + c * equation.length_n)[:, None] * u
        right = p.masses[:, None] * equation.y + h * h * (equation.constant + p.pulled.T @ pull)
        right[equation.pins] += equation.hold * p.positions[equation.pins]
        x = np.where(equation.free[:, None], equation.solve(A, right - A @ held), x)
    return x


def _descent(equation: Equation, x: FloatArray, how: Integrator) -> FloatArray:
    for _ in range(how.iterations):
        x = x - how.rate * equation.free_gradient(x)
    return x


def _converged(equation: Equation, x: FloatArray, how: Integrator) -> FloatArray:
    """Minimise g by Newton's method with a shift and a line search, else solve by residuals."""
    best, since = np.inf, 0
    for _ in range(MOST_ITERATIONS):
        gradient = equation.free_gradient(x)
        norm = float(np.linalg.norm(gradient))
        since = 0 if norm < 0.5 * best else since + 1
        best = min(best, norm)
        if norm == 0.0 or not np.isfinite(norm) or since > 3:
            break
        A = equation.matrix(x, "exact")
        if equation.conservative:
            A = _shifted(equation, A)
        x = _searched(equation, x, gradient, -equation.solve(A, gradient))
    return x


def _shifted(equation: Equation, A: FloatArray) -> FloatArray:
    """Return A plus the least of some multiples of M that makes it positive definite."""
    free = np.ix_(*2 * [np.repeat(equation.free, 3)])
    M = np.diag(np.repeat(equation.start.p.masses, 3))
    shift = 0.0
    while shift < 1e12:
        try:
            np.linalg.cholesky((A + shift * M)[free])
        except np.linalg.LinAlgError:
            shift = max(1e-2, 4.0 * shift)
        else:
            break
    return A + shift * M


def _searched(
    equation: Equation, x: FloatArray, gradient: FloatArray, step: FloatArray
) -> FloatArray:
    """Return x + t step with the largest t = 1, 1/2, ... that lowers g, or the residual."""
    norm, is_minimum = float(np.linalg.norm(gradient)), equation.conservative
    slope = float((gradient * step).sum())
    value = equation.value(x) if is_minimum else 0.0
    t = 1.0
    while t > 1e-6:
        there = x + t * step
        residual = float(np.linalg.norm(equation.free_gradient(there)))
        if residual < 0.5 * norm and (norm < 1e-6 or not is_minimum):
            return there
        if is_minimum and equation.value(there) <= value + 1e-4 * t * slope:
            return there
        if not is_minimum and residual < (1.0 - 1e-4 * t) * norm:
            return there
        t *= 0.5
    return x + step if norm < 1e-6 else x


_METHODS: Mapping[str, Callable[[Equation, FloatArray, Integrator], FloatArray]] = {
    "newton": _newton,
    "local_global": _local_global,
    "descent": _descent,
    "converged": _converged,
}
