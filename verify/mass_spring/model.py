"""A step of every model that a solver may declare, dense.

An implicit step seeks x with M (x - y) = h² f(x), y = x_n + h v_n; with f = -grad E that is the
minimum of g(x) = 1/2 (x - y)' M (x - y) + h² E(x) (Liu et al. 2013). Everything is a dense array of
NumPy, for up to some thirty particles, and independent of the solvers of `reference`.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray

from .problem import SpringProblem, accelerations, damper_forces, frames, spring_forces, stretches

# Newton's method ends in rounding long before this on systems of this size.
MAX_ITERATIONS = 200
# The usual share of the decrease promised by the slope that a line search demands.
DECREASE = 1e-4
# It ends where so many iterations have not halved the gradient.
MAX_STALLED = 3
# A first step longer than this share of the displacement shows that positions are not the solution.
ESTIMATED = 1e-2


class Integrator(NamedTuple):
    """How positions follow from the state at the start of a step."""

    # explicit, symplectic, positions_first (symplectic, x' = x + h v before v' = v + h f(x') / m),
    # taylor (x + h v + h²/2 a), runge_kutta; newton, local_global, converged
    method: str
    start: str = "x_n"  # of the iterations, "x_n", "y" or "s_n"
    iterations: int = 1
    hessian: str = "exact"  # of Newton's method: a key of HESSIANS
    # whether Newton's method projects an indefinite Hessian and searches along its steps
    is_safeguarded: bool = False

    @property
    def explicit(self) -> bool:
        """Whether no equation is solved."""
        return self.method in EXPLICIT


class StepModel(NamedTuple):
    """A complete description of an honest step."""

    integrator: Integrator = Integrator("converged", "y")  # of the positions
    substeps: int = 1  # equal steps that make up h
    # none, explicit, length_rate, end_velocity; implicit in diag(C), in C's 3 x 3 blocks, or in C,
    # beside explicit springs: diagonal, blocks, matrix
    damper: str = "length_rate"
    scaling: float = 1.0  # of every velocity after each substep
    # eliminated, overwritten; with a number: penalty (weight), springs (stiffness), heavy, or
    # weightless (heavy, but not pulled by gravity)
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
    If they are not, the result is an estimate, and the last of several frames repeat the first
    that is far from them.
    """
    p = _with_pins(p, model)
    if model.integrator.explicit and model.damper == "none":
        p = p.changed(dampings=np.zeros_like(p.dampings))
    if near is not None and np.isfinite(near).all():
        frames: list[FloatArray | None] = [*near.reshape(-1, p.count, 3)]
    else:
        frames = [None] * (p.steps or 1)
    is_solved = model.substeps == 1 and model.pins != "overwritten"
    states: list[State] = [(p.positions, p.velocities)]
    for frame in frames:
        start = states[-1]
        x, v = _step(p, model, *start, frame if is_solved else None)
        states.append((x, v))
        if frame is not None and _norm(x - frame) > ESTIMATED * _norm(frame - start[0]):
            break
    states += states[-1:] * (len(frames) + 1 - len(states))
    X, V = map(np.array, zip(*states, strict=True))
    answer = {"positions": X[1:], "velocities": V[1:]}
    return answer if p.steps else {name: values[-1] for name, values in answer.items()}


def predicted(
    p: SpringProblem, model: StepModel, near: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return the result of `simulate`, {} if the model's matrix is singular."""
    with np.errstate(all="ignore"):
        try:
            return simulate(p, model, near)
        except np.linalg.LinAlgError:
            return {}


def _with_pins(p: SpringProblem, model: StepModel) -> SpringProblem:
    """Return the problem with the pins' masses as the model has them."""
    if model.pin_kind not in ("heavy", "weightless"):
        return p
    masses, weights = p.masses.copy(), p.weights.copy()
    masses[p.pinned] = model.pin_strength
    if model.pin_kind == "weightless":
        weights[p.pinned] = 0.0
    return p.changed(masses=masses, weights=weights)


def _step(
    p: SpringProblem, model: StepModel, x: FloatArray, v: FloatArray, near: FloatArray | None
) -> State:
    h = p.h / model.substeps
    if model.substeps > 1 and _falls_freely(p, model):
        return _free_fall(Substep(p, model, x, v, h))
    for _ in range(model.substeps):
        x, v = substep(Substep(p, model, x, v, h, near))
    return x, v


def _falls_freely(p: SpringProblem, model: StepModel) -> bool:
    """Return whether the forces of all substeps of an explicit method are the same."""
    is_usual = (model.velocity, model.scaling) == ("separate", 1.0)
    coupled = p.stiff or p.damped or p.pinned.size
    return bool(is_usual and not coupled and model.integrator.method in SHARES)


def _free_fall(start: Substep) -> State:
    """Return the state after all substeps at once."""
    p, model, x, v, h, _ = start
    n, a = model.substeps, accelerations(p, x, v)
    parts = n * (n - 1) / 2 + n * SHARES[model.integrator.method]
    return x + n * h * v + parts * h * h * a, v + n * h * a


def substep(start: Substep) -> State:
    """Return positions and velocities a time h later."""
    p, model, x_n, separate, h, _ = start
    if model.integrator.explicit:
        x, separate = EXPLICIT[model.integrator.method](start)
    else:
        equation = StepEquation(start)
        x = _implicit(equation)
        if model.velocity == "separate":
            force = x - equation.y - equation.gradient(x) / p.inertia
            separate = separate + force / h
    v = model.scaling * ((x - x_n) / h if model.velocity == "displacement" else separate)
    if model.pins in ("overwritten", "eliminated"):
        x = x.copy()
        x[p.pinned], v[p.pinned] = x_n[p.pinned], 0.0
    return x, v


def first_equation(p: SpringProblem, model: StepModel) -> "StepEquation":
    """Return the equation of the first substep."""
    p = _with_pins(p, model)
    h = p.h / model.substeps
    return StepEquation(Substep(p, model, p.positions, p.velocities, h))


def _explicit_rates(start: Substep, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return accelerations with the damper that the model has, zero at the pins."""
    p, model = start.p, start.model
    a = accelerations(p, x, v)
    if model.pin_kind in ("penalty", "springs"):
        pull = model.pin_strength * (p.positions - x)[p.pinned]
        a[p.pinned] += pull / p.inertia[p.pinned]
    a = np.where(start.free, a, 0.0)
    if model.damper not in ("diagonal", "blocks", "matrix"):
        return a
    # (M + h D)^-1 M a with the part D of C that the model treats implicitly.
    _, u = frames(p, x)
    D = _assemble(p, p.dampings[:, None, None] * u[:, :, None] * u[:, None, :])
    if model.damper == "diagonal":
        D = np.diag(np.diag(D))
    elif model.damper == "blocks":
        D = D * np.kron(np.eye(p.count), np.ones((3, 3)))
    M, free = np.repeat(p.masses, 3), np.repeat(start.free.ravel(), 3)
    solution = np.zeros(len(M))
    A = (np.diag(M) + start.h * D)[np.ix_(free, free)]
    solution[free] = np.linalg.solve(A, (M * a.ravel())[free])
    return solution.reshape(a.shape)


# The share of the new velocity, beside the old one, that moves positions.
SHARES = {"explicit": 0.0, "positions_first": 0.0, "taylor": 0.5, "symplectic": 1.0}


def _by_one_rate(start: Substep) -> State:
    """Step by one acceleration: explicit or symplectic Euler, or x + h v + h²/2 a.

    It is that of the start, or of the new positions where these come first.
    """
    _, model, x, v, h, _ = start
    y = x + h * v
    a = _explicit_rates(start, y if model.integrator.method == "positions_first" else x, v)
    return y + SHARES[model.integrator.method] * h * h * a, v + h * a


def _runge_kutta(start: Substep) -> State:
    _, _, x, v, h, _ = start
    dx, dv = v, _explicit_rates(start, x, v)
    sum_x, sum_v = dx, dv
    for share, weight in ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        middle = x + share * h * dx, v + share * h * dv
        dx, dv = middle[1], _explicit_rates(start, *middle)
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
    """M (x - y) - h² f(x) = 0 of a substep, its derivative and, where it exists, g."""

    def __init__(self, start: Substep) -> None:
        """Set up y and the forces that stay through the step."""
        p, model, x, v, h, _ = start
        self.start, self.free = start, start.free
        self.y = x + h * v
        self.constant = p.constant
        if model.damper == "explicit":
            self.constant = self.constant + damper_forces(p, x, v)
        self.damped = p.damped and model.damper in ("length_rate", "end_velocity")
        self.by_length = model.damper == "length_rate"
        # pins that the equation holds, and how strongly
        self.pins, self.hold = p.pinned[:0], 0.0
        if model.pin_kind in ("penalty", "springs"):
            self.pins = p.pinned
            self.hold = model.pin_strength * (h * h if model.pin_kind == "springs" else 1.0)
        self.conservative = self.by_length or not self.damped

    @property
    def starts(self) -> dict[str, FloatArray]:
        """Where iterations may begin; s_n = y + h² M⁻¹ f_ext (Bouaziz et al. 2014, Algorithm 1)."""
        return {"x_n": self.start.x, "y": self.y, "s_n": self.y + self.fall}

    @property
    def fall(self) -> FloatArray:
        """The displacement by the forces that stay through the step."""
        return np.asarray(self.start.h**2 * self.constant / self.start.p.inertia)

    @property
    def uncoupled(self) -> bool:
        """Whether no spring acts and the matrix is M: an iteration arrives."""
        return not (self.start.p.stiff or self.damped or len(self.pins))

    @cached_property
    def first_lengths(self) -> FloatArray:
        """The lengths of springs at the start, at which dampers are at rest."""
        return frames(self.start.p, self.start.x)[0]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return M (x - y) - h² f(x), shape (particle, 3)."""
        p, h = self.start.p, self.start.h
        f = self.constant + spring_forces(p, x)
        if self.damped and self.by_length:
            length, u = frames(p, x)
            pull = p.dampings * (length - self.first_lengths) / h
            f = f - p.incidence.T @ (pull[:, None] * u)
        elif self.damped:
            f = f + damper_forces(p, x, (x - self.start.x) / h)
        gradient = p.inertia * (x - self.y) - h * h * f
        gradient[self.pins] += self.hold * (x - p.positions)[self.pins]
        return gradient

    def free_gradient(self, x: FloatArray) -> FloatArray:
        """Return the gradient, zero at particles that the step may not move."""
        return np.where(self.free, self.gradient(x), 0.0)

    def value(self, x: FloatArray) -> float:
        """Return g(x)."""
        p, h = self.start.p, self.start.h
        length, _ = frames(p, x)
        energy = 0.5 * (p.stiffnesses * stretches(p, length) ** 2).sum()
        if self.damped:
            energy += 0.5 / h * (p.dampings * (length - self.first_lengths) ** 2).sum()
        penalty = 0.5 * self.hold * ((x - p.positions)[self.pins] ** 2).sum()
        inertia = 0.5 * (p.inertia * (x - self.y) ** 2).sum()
        return float(inertia + h * h * (energy - (self.constant * x).sum()) + penalty)

    def matrix(self, x: FloatArray, kind: str) -> FloatArray:
        """Return the matrix of a Newton step, (3 particle, 3 particle)."""
        p = self.start.p
        length, u = frames(p, x)
        uu = u[:, :, None] * u[:, None, :]
        k = np.where(p.tension_only & (length <= p.rest_lengths), 0.0, p.stiffnesses)
        safe = np.maximum(length, 1e-150)
        across = HESSIANS[kind](p.rest_lengths / safe)
        blocks = _isotropic(k * across) + (k * (1.0 - across))[:, None, None] * uu
        if self.damped:
            blocks = blocks + self._damper_blocks(x, kind, uu, u, safe)
        return self.with_inertia(blocks)

    def _damper_blocks(
        self, x: FloatArray, kind: str, uu: FloatArray, u: FloatArray, length: FloatArray
    ) -> FloatArray:
        p = self.start.p
        c = (p.dampings / self.start.h)[:, None, None]
        if self.by_length:
            across = HESSIANS[kind](self.first_lengths / length)
            return c * (_isotropic(across) + (1.0 - across)[:, None, None] * uu)
        if kind != "exact":
            return c * uu
        # The derivative of (w·u) u by w, the relative displacement, and by u.
        w, normal = p.incidence @ (x - self.start.x), np.eye(3) - uu
        w_normal = np.einsum("sab,sb->sa", normal, w)
        turning = (w * u).sum(1)[:, None, None] * normal + u[:, :, None] * w_normal[:, None, :]
        return c * (uu + turning / length[:, None, None])

    def with_inertia(self, blocks: FloatArray) -> FloatArray:
        """Return M + h² times the sum of the blocks of springs, and the hold of pins."""
        p, size = self.start.p, blocks.shape[1]
        A = self.start.h**2 * _assemble(p, blocks)
        A.flat[:: len(A) + 1] += np.repeat(p.masses, size)
        if self.hold:
            rows = (self.pins[:, None] * size + np.arange(size)).ravel()
            A[rows, rows] += self.hold
        return A

    def solve(self, A: FloatArray, right: FloatArray) -> FloatArray:
        """Return A^-1 right over the free particles, zero elsewhere, shape (particle, 3)."""
        free = np.repeat(self.free.ravel(), len(A) // len(right))
        solution, b = np.zeros_like(right).reshape(len(A), -1), right.reshape(len(A), -1)
        solution[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
        return solution.reshape(right.shape)

    def is_definite(self, A: FloatArray) -> bool:
        """Return whether a matrix is positive definite over the free particles."""
        free = np.repeat(self.free.ravel(), len(A) // self.start.p.count)
        return is_positive_definite(A[np.ix_(free, free)])


def is_positive_definite(A: FloatArray) -> bool:
    """Return whether Cholesky's method factorises a symmetric matrix."""
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        return False
    return True


# The share of a spring's stiffness across it, given r/l; along it, that is 1.
HESSIANS: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "exact": lambda ratio: 1.0 - ratio,
    "gauss": lambda ratio: 0.0 * ratio,
    "projected": lambda ratio: np.maximum(1.0 - ratio, 0.0),
    "isotropic": lambda ratio: 1.0 + 0.0 * ratio,
}


def _isotropic(scale: FloatArray) -> FloatArray:
    return scale[:, None, None] * np.eye(3)


def _assemble(p: SpringProblem, blocks: FloatArray) -> FloatArray:
    """Return the sum over springs of (A_i A_i') x block, (size particle, size particle)."""
    n, size = p.count, blocks.shape[1]
    right = (p.incidence[:, :, None, None] * blocks[:, None]).reshape(len(blocks), -1)
    sums = (p.incidence.T @ right).reshape(n, n, size, size)
    return np.ascontiguousarray(sums.transpose(0, 2, 1, 3)).reshape(size * n, size * n)


def nth(iterates: Iterator[FloatArray], count: int) -> FloatArray:
    """Return the iterate after so many iterations, the last one if there are fewer."""
    return deque(islice(iterates, count + 1), maxlen=1)[0]


def _implicit(equation: StepEquation) -> FloatArray:
    """Return the positions at the end of an implicit step."""
    start, free = equation.start, equation.free
    integrator = start.model.integrator
    x = np.where(free, equation.starts[integrator.start], start.x)
    if equation.uncoupled:  # g is quadratic
        return np.where(free, equation.y + equation.fall, x)
    if integrator.method == "converged":
        return _converged(equation, x)
    return nth(ITERATES[integrator.method](equation, x), integrator.iterations)


def _newton(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    integrator = equation.start.model.integrator
    while True:
        yield x
        A, gradient = equation.matrix(x, integrator.hessian), equation.free_gradient(x)
        if integrator.is_safeguarded and not equation.is_definite(A):
            A = equation.matrix(x, "projected")
        step = -equation.solve(A, gradient)
        if not integrator.is_safeguarded:
            x = x + step
        elif (lower := _lower(equation, x, gradient, step)) is None:
            return
        else:
            x = lower


def _local_global(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    """Solve (M + h²L) x_next = h² J d + M y + h² f_ext, pins moved to the right-hand side."""
    start, free = equation.start, equation.free
    p, h = start.p, start.h
    k, c = p.stiffnesses, (p.dampings / h if equation.damped else 0.0 * p.dampings)
    A = equation.with_inertia((k + c)[:, None, None] * np.eye(1))
    fixed = p.inertia * equation.y + h * h * equation.constant - A @ np.where(free, 0.0, x)
    fixed[equation.pins] += equation.hold * p.positions[equation.pins]
    inverse = equation.solve(A, np.eye(len(A)))
    while True:
        yield x
        length, u = frames(p, x)
        size = k * (length - stretches(p, length)) + c * equation.first_lengths
        right = fixed + h * h * (p.incidence.T @ (size[:, None] * u))
        x = np.where(free, inverse @ right, x)


def _converged(equation: StepEquation, x: FloatArray) -> FloatArray:
    """Minimise g by Newton's method with a shift and a line search, else solve by residuals.

    From positions near that a long step, the first or the last, shows that they are not: it is the
    estimate.
    """
    start = equation.start
    best, stalled, near, step = np.inf, 0, start.near, np.zeros_like(x)
    x = x if near is None else np.where(equation.free, near, x)
    for iteration in range(MAX_ITERATIONS):
        gradient = equation.free_gradient(x)
        norm = _norm(gradient)
        stalled = 0 if norm < 0.5 * best else stalled + 1
        best = min(best, norm)
        if norm == 0.0 or not np.isfinite(norm):
            return x
        A = equation.matrix(x, "exact")
        if equation.conservative:
            A = _shifted(equation, A)
        step = -equation.solve(A, gradient)
        moved = x - equation.start.x
        if near is not None and not iteration and _norm(step) > ESTIMATED * _norm(moved):
            return x + step
        lower = _lower(equation, x, gradient, step)
        if lower is None or stalled > MAX_STALLED:
            break
        x = lower
    return x if near is None else x + step


def _norm(x: FloatArray) -> float:
    return float(np.sqrt((x * x).sum()))


def _shifted(equation: StepEquation, A: FloatArray) -> FloatArray:
    """Return A plus the least of some multiples of M that makes it positive definite."""
    M, shift = np.diag(np.repeat(equation.start.p.masses, 3)), 0.0
    while shift < 1e12 and not equation.is_definite(A + shift * M):
        shift = max(1e-2, 4.0 * shift)
    return A + shift * M


def _lower(
    equation: StepEquation, x: FloatArray, gradient: FloatArray, step: FloatArray
) -> FloatArray | None:
    """Return x + t step with the largest t = 1, 1/2, ... that lowers g, or the residual, enough.

    It is None if no t does.
    """
    norm, slope = _norm(gradient), float((gradient * step).sum())
    start_value = equation.value(x) if equation.conservative else 0.0
    noise = 1e-13 * abs(start_value)  # rounding of g hides that it falls
    for t in 0.5 ** np.arange(40.0):
        trial = x + t * step
        if equation.conservative:
            is_lower = equation.value(trial) <= start_value + DECREASE * t * slope + noise
        else:
            is_lower = _norm(equation.free_gradient(trial)) < (1.0 - DECREASE * t) * norm
        if is_lower:
            return trial
    return None


# The iterates of a method from a start, without end.
ITERATES: Mapping[str, Callable[[StepEquation, FloatArray], Iterator[FloatArray]]] = {
    "newton": _newton,
    "local_global": _local_global,
}
