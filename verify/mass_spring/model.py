"""A step of every model that a solver may declare, and of the faults that occur in them, dense.

An implicit step seeks x with M (x - y) = h² f(x), y = x_n + h v_n; with f = -grad E that is the
minimum of g(x) = 1/2 (x - y)' M (x - y) + h² E(x) (Liu et al. 2013). Everything is a dense array of
NumPy, for up to some thirty particles, and independent of the solvers of `reference`.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray

from .formulas import evaluate
from .problem import SpringProblem, accelerations, damper_forces, frames, spring_forces, stretches

# Rows of the unknowns that are taken for those of particles, as if no particle were left out.
ROW_MISTAKES = (
    "rows of the solution", "rows of the right-hand side",
    "rows of the solution and right-hand side",
)  # fmt: skip
# Pins that a step does not move.
ELIMINATED = ("eliminated", "unattached", "first", "origin", "dropped", *ROW_MISTAKES)
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
    # taylor (x + h v + h²/2 a), runge_kutta, in_place; newton, local_global, descent (along the
    # gradient), converged
    method: str
    start: str = "x_n"  # of the iterations, "x_n", "y" or "s_n"
    iterations: int = 1
    # of Newton's method: a key of HESSIANS; or frozen: exact where iterations begin
    hessian: str = "exact"
    rate: float = 1.0  # factor of the step of Newton's method or of the gradient
    is_stale: bool = False  # whether all iterations use the gradient of the first
    # the share of the decrease promised by the slope that a line search of Newton's method demands;
    # None: there is no line search, and an indefinite Hessian is not projected
    decrease: float | None = None
    # of conjugate gradients: formulas of their preconditioner, and of β from r·z before and after a
    # step
    scale: str = ""
    beta: str = "after / before"

    @property
    def explicit(self) -> bool:
        """Whether no equation is solved."""
        return self.method in EXPLICIT


class SystemMatrix(NamedTuple):
    """How the system matrix is put together from masses and springs."""

    masses: float = 1.0  # how many times M is added
    power: int = 2  # of h before the springs' part, with its sign
    sign: float = 1.0
    stiffness: bool = True  # whether the springs' part has its factor k
    # what a spring adds to the rows of its first and of its second end, in the columns of both
    element: tuple[float, ...] = (1.0, -1.0, -1.0, 1.0)
    # what the diagonal has: sum, of all springs; last, spring of a particle; or last of each end
    diagonal: str = "sum"
    filled: str = "A"  # a formula of what becomes of it if a triangle is not filled
    components: bool = True  # whether x, y and z are coupled
    damper_power: int = 0  # the power of h by which the dampers' part differs from h C
    dampers: str = "D"  # a formula of what stands for their part of the matrix
    # of the equation for dv: the factor of h K v, and the powers of h by which that and the
    # right-hand side differ
    drag: float = 1.0
    drag_power: int = 0
    is_drag_right: bool = False  # whether K of h K v has no mistake of the matrix
    right_power: int = 0
    h: str = "h"  # a formula of what stands for h before the springs' part
    is_by_columns: bool = False  # the right-hand side: all x, then all y, in rows of x, y and z
    # exact; "first order": multiplied by 1 - h²/m K; a key of ITERATIONS with a number of them; or
    # "factors", the number of terms that their inner products lack, and a formula of L, D and b
    inverse: str = "exact"
    # of local/global iterations: the element of the pins' part of the right-hand side, which has no
    # other mistake; None: it is made of the matrix
    pins_element: tuple[float, ...] | None = None

    @property
    def is_skew(self) -> bool:
        """Whether it is not symmetric."""
        return self.element[1] != self.element[2] or self.filled in ("np.triu(A)", "np.tril(A)")


RIGHT_MATRIX = SystemMatrix()


class StepModel(NamedTuple):
    """A complete description of a step, honest or not."""

    integrator: Integrator = Integrator("converged", "y")  # of the positions
    substeps: int = 1  # equal steps that make up h
    # none, explicit, length_rate, end_velocity; implicit in diag(C), in C's 3 x 3 blocks, or in C,
    # beside explicit springs: diagonal, blocks, matrix
    damper: str = "length_rate"
    scaling: float = 1.0  # of every velocity after each substep
    # eliminated, overwritten; with a number: penalty (weight), springs (stiffness), heavy,
    # weightless (heavy, but not pulled by gravity) or falling (mass); at_the_end: free through the
    # substeps; free; unattached: no springs to them; first: only one is held; origin: their columns
    # dropped, so that springs end at the origin; dropped: eliminated, then moved by gravity; held
    # on the right: on that side of the equation alone; identity rows: of the matrix, but the
    # right-hand side is not zero; coordinates: those with the numbers of a formula are held
    pins: str = "eliminated"
    # displacement, separate; or a formula with d = x' - x (for names see `Substep.value`)
    velocity: str = "displacement"
    matrix: SystemMatrix = RIGHT_MATRIX  # of an implicit step
    # whether a Newton step solves (M + h C + h² K) dv = h (f - h K v) for the change of velocity
    # instead of the displacement, which matters beside a fault
    dv: bool = False
    dampers_apart: bool = False  # whether a fault of the springs' part spares the dampers' part
    inertia: str = ""  # a formula of what stands for y = x + h v
    # divided among substeps; undivided; one substep less: divided by a number that is one more;
    # before: of the last request, in the matrix only; or a formula of what stands for h
    time: str = "divided"
    # whether forces of earlier substeps act again: all, or the dampers' of an implicit step
    keeps_forces: bool = False
    # of a matrix that is not positive definite: LU; or Cholesky's, unchecked. Eigen's dense LLT
    # stops at a pivot and solves with what it has (LLT); its SimplicialLLT does not solve, so that
    # the unknown, a displacement or a change of velocity, stays zero or what memory held
    factorisation: str = "LU"
    # formulas of what is made of positions and velocities, x1 and v1, after each solution
    update: Mapping[str, str] = {}
    right_start: bool = False  # whether iterations begin as if y were x + h v, whatever it is
    # formulas of a motion: problem, fields of the problem of each step; end, the state that a step
    # ends with; state, that which the next one starts from; answer, of the positions X and the
    # velocities V of the start and of all frames; matrix: that of the first step is kept, on
    # both sides of the equation if this is empty, else on the left
    frames: Mapping[str, Mapping[str, str]] = {}

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
        """Which coordinates the step may move, shape (particle, 3)."""
        return ~_held(self.p, self.model)

    def value(self, formula: str, **values: Any) -> FloatArray:
        """Return a formula's value, with names of `formulas.py` and of the request's state x0, v0.

        x, v and h are those at the start of the substep, `whole` is the whole time step.
        """
        p = self.p.changed(positions=self.x, velocities=self.v)
        if self.model.damper == "none":
            p = p.changed(dampings=0.0 * p.dampings)
        start = {"x0": self.p.positions, "v0": self.p.velocities, "whole": self.p.h}
        return np.asarray(evaluate(formula, p, {"h": self.h, **start, **values}))


def _held(p: SpringProblem, model: StepModel) -> BoolArray:
    """Return which coordinates the step may not move, shape (particle, 3)."""
    mask = np.zeros((p.count, 3), dtype=bool)
    if model.pins in ELIMINATED:
        mask[p.pinned] = True
    elif model.pin_kind == "coordinates":
        mask.flat[evaluate(model.pins.removeprefix("coordinates "), p) % mask.size] = True
    return mask


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
    if near is not None and np.isfinite(near).all() and not model.frames.keys() & {"end", "answer"}:
        frames: list[FloatArray | None] = [*near.reshape(-1, p.count, 3)]
    else:
        frames = [None] * (p.steps or 1)
    states, start = [(p.positions, p.velocities)], (p.positions, p.velocities)
    for number, frame in enumerate(frames):
        values = {"X": [x for x, _ in states], "V": [v for _, v in states], "step": number}
        now = Substep(p, model, *start, p.h)
        q = p.changed(**_formulas(now, "problem", values)) if "problem" in model.frames else p
        x, v = _step(q, model, *start, frame if _ends_solved(model) else None)
        states.append(_replaced(now, "end", (x, v), values))
        if frame is not None and _norm(x - frame) > ESTIMATED * _norm(frame - start[0]):
            break
        start = _replaced(now, "state", states[-1], values)
    states += states[-1:] * (len(frames) + 1 - len(states))
    return _answer(Substep(p, model, *states[0], p.h), states)


def _formulas(start: Substep, name: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the formulas of a motion by the fields that they replace."""
    formulas = start.model.frames.get(name, {})
    return {field: start.value(formula, **values) for field, formula in formulas.items()}


def _replaced(start: Substep, name: str, state: State, values: Mapping[str, Any]) -> State:
    """Return a state as the formulas of a motion have it."""
    if name not in start.model.frames:
        return state
    fields = _formulas(start, name, {**values, "x1": state[0], "v1": state[1]})
    return fields.get("positions", state[0]), fields.get("velocities", state[1])


def _answer(start: Substep, states: list[State]) -> dict[str, FloatArray]:
    """Return the answer of a step or a motion with these states, the first of them its start."""
    X, V = map(np.array, zip(*states, strict=True))
    answer = {"positions": X[1:], "velocities": V[1:]}
    answer |= _formulas(start, "answer", {"X": X, "V": V}) if "answer" in start.model.frames else {}
    return answer if start.p.steps else {name: frames[-1] for name, frames in answer.items()}


def _ends_solved(model: StepModel) -> bool:
    """Return whether the positions at the end of a step are the solution of its equation."""
    is_changed = model.update or model.pins in ("overwritten", "at_the_end")
    return model.substeps == 1 and not is_changed


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
    """Return the problem with the pins' masses, springs or number as the model has them."""
    if p.linear is not None:
        p = p.changed(linear=_with_pins(p.linear, model))
    kind, pinned = model.pin_kind, p.pinned
    if kind in ("heavy", "falling", "weightless"):
        masses, weights = p.masses.copy(), p.weights.copy()
        masses[pinned] = model.pin_strength
        if kind == "falling":
            weights[pinned] *= model.pin_strength / p.weighing[pinned, None]
        elif kind == "weightless":
            weights[pinned] = 0.0
        return p.changed(masses=masses, weights=weights)
    if kind == "unattached":
        attached = ~np.isin(p.springs, pinned).any(axis=1)
        return p.changed(stiffnesses=attached * p.stiffnesses, dampings=attached * p.dampings)
    if kind == "coordinates":
        return p.changed(velocities=np.where(_held(p, model), 0.0, p.velocities))
    return p.changed(pinned=pinned[: {"first": 1, "free": 0}.get(kind)])


# What `time` of a model is, beside formulas.
TIMES = ("divided", "undivided", "one substep less", "before")


def _step(
    p: SpringProblem, model: StepModel, x: FloatArray, v: FloatArray, near: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    h = p.h
    if model.time not in TIMES:
        h = float(evaluate(model.time, p))
    if model.time != "undivided":
        h /= model.substeps
    pins, first = x[p.pinned], p
    if model.substeps > 1 and _falls_freely(p, model):
        return _free_fall(Substep(p, model, x, v, h))
    for _ in range(model.substeps - (model.time == "one substep less")):
        x, v, start = *substep(Substep(p, model, x, v, h, near)), (x, v)
        if model.keeps_forces:
            kept = (
                accelerations(first, *start) * first.inertia
                if model.integrator.explicit
                else damper_forces(first, *start)
            )
            p = p.changed(external=p.external + kept)
    if model.pins == "at_the_end":
        x, v = x.copy(), v.copy()
        x[p.pinned], v[p.pinned] = pins, 0.0
    return x, v


def _falls_freely(p: SpringProblem, model: StepModel) -> bool:
    """Return whether the forces of all substeps of an explicit method are the same."""
    usual = (model.velocity, model.scaling) == ("separate", 1.0) and not model.update
    usual &= model.time != "one substep less" and not model.keeps_forces
    coupled = p.stiff or p.damped or p.pinned.size
    return bool(usual and not coupled and model.integrator.method in SHARES)


def _free_fall(start: Substep) -> tuple[FloatArray, FloatArray]:
    """Return the state after all substeps at once."""
    p, model, x, v, h, _ = start
    n, a = model.substeps, accelerations(p, x, v)
    parts = n * (n - 1) / 2 + n * SHARES[model.integrator.method]
    return x + n * h * v + parts * h * h * a, v + n * h * a


def substep(start: Substep) -> tuple[FloatArray, FloatArray]:
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
    v = (x - x_n) / h if model.velocity == "displacement" else separate
    if model.velocity not in ("displacement", "separate"):
        v = start.value(model.velocity, d=x - x_n, x1=x)
    v = v * model.scaling
    if model.update:
        values = {name: start.value(formula, d=x - x_n, x1=x, v1=v)
                  for name, formula in model.update.items()}  # fmt: skip
        x, v = values.get("positions", x), values.get("velocities", v)
    if model.pins in ("overwritten", *ELIMINATED):
        x, v = x.copy(), v.copy()
        fall = h * h * p.gravity if model.pins == "dropped" else 0.0
        x[p.pinned], v[p.pinned] = x_n[p.pinned] + fall, 0.0
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
    a[~start.free] = 0.0
    if model.damper not in ("diagonal", "blocks", "matrix"):
        return a
    # (M + h D)^-1 M a with the part D of C that the model treats implicitly.
    _, u = frames(p, x)
    D = _assemble(p, p.dampings[:, None, None] * u[:, :, None] * u[:, None, :])
    if model.damper == "diagonal":
        D = np.diag(np.diag(D))
    elif model.damper == "blocks":
        D = D * np.kron(np.eye(p.count), np.ones((3, 3)))
    M, free = p.inertia_diagonal, start.free.ravel()
    solution = np.zeros(len(M))
    A = (np.diag(M) + start.h * D)[np.ix_(free, free)]
    solution[free] = np.linalg.solve(A, (M * a.ravel())[free])
    return solution.reshape(a.shape)


# The share of the new velocity, beside the old one, that moves positions.
SHARES = {"explicit": 0.0, "positions_first": 0.0, "taylor": 0.5, "symplectic": 1.0, "beyond": 1.5}


def _by_one_rate(start: Substep) -> tuple[FloatArray, FloatArray]:
    """Step by one acceleration: explicit or symplectic Euler, or x + h v + h²/2 a.

    It is that of the start, or of the new positions where these come first.
    """
    _, model, x, v, h, _ = start
    y = start.value(model.inertia) if model.inertia else x + h * v
    a = _explicit_rates(start, y if model.integrator.method == "positions_first" else x, v)
    return y + SHARES[model.integrator.method] * h * h * a, v + h * a


def _half_a(start: Substep) -> tuple[FloatArray, FloatArray]:
    """Step by x + h v + h/2 a, where h²/2 a is meant."""
    _, _, x, v, h, _ = start
    a = _explicit_rates(start, x, v)
    return x + h * v + 0.5 * h * a, v + h * a


def _runge_kutta(start: Substep) -> tuple[FloatArray, FloatArray]:
    _, _, x, v, h, _ = start
    dx, dv = v, _explicit_rates(start, x, v)
    sum_x, sum_v = dx, dv
    for share, weight in ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        middle = x + share * h * dx, v + share * h * dv
        dx, dv = middle[1], _explicit_rates(start, *middle)
        sum_x, sum_v = sum_x + weight * dx, sum_v + weight * dv
    return x + h / 6 * sum_x, v + h / 6 * sum_v


def _in_place(start: Substep) -> tuple[FloatArray, FloatArray]:
    """Move particles in turn, each by forces of the new positions of its predecessors."""
    _, _, x, v, h, _ = start
    x, v = x.copy(), v.copy()
    for i in range(len(x)):
        v[i] += h * _explicit_rates(start, x, v)[i]
        x[i] += h * v[i]
    return x, v


EXPLICIT: Mapping[str, Callable[[Substep], tuple[FloatArray, FloatArray]]] = {
    "explicit": _by_one_rate,
    "symplectic": _by_one_rate,
    "positions_first": _by_one_rate,
    "taylor": _by_one_rate,
    "beyond": _by_one_rate,
    "half_a": _half_a,
    "runge_kutta": _runge_kutta,
    "in_place": _in_place,
}


class StepEquation:
    """M (x - y) - h² f(x) = 0 of a substep, its derivative and, where it exists, g."""

    def __init__(self, start: Substep) -> None:
        """Set up y and the forces that stay through the step."""
        p, model, x, v, h, _ = start
        self.start, self.free = start, start.free
        self.linear = p.linear or p  # whose springs the matrix is put together from
        self.y = start.value(model.inertia) if model.inertia else x + h * v
        self.constant = p.constant
        if model.damper == "explicit":
            self.constant = self.constant + damper_forces(p, x, v)
        self.damped = p.damped and model.damper in ("length_rate", "end_velocity")
        self.by_length = model.damper == "length_rate" and p.damping == "along"
        # pins that the equation holds, and how strongly
        self.pins, self.hold = p.pinned[:0], 0.0
        if model.pin_kind in ("penalty", "springs"):
            self.pins = p.pinned
            self.hold = model.pin_strength * (h * h if model.pin_kind == "springs" else 1.0)
        self.conservative = (
            p.ends == (1.0, 1.0)
            and p.accumulated
            and p.normalised
            and (p.length, p.pull, p.damper_pull) == (None, None, None)
            and (self.by_length or not self.damped)
        )

    @property
    def starts(self) -> dict[str, FloatArray]:
        """Where iterations may begin; s_n = y + h² M⁻¹ f_ext (Bouaziz et al. 2014, Algorithm 1)."""
        start = self.start
        y = start.x + start.h * start.v if start.model.right_start else self.y
        return {"x_n": start.x, "y": y, "s_n": y + self.fall}

    @property
    def fall(self) -> FloatArray:
        """The displacement by the forces that stay through the step."""
        return np.asarray(self.start.h**2 * self.constant / self.start.p.inertia)

    @property
    def uncoupled(self) -> bool:
        """Whether no spring acts and the matrix is M: a Newton step arrives."""
        p, model = self.start.p, self.start.model
        usual = model.matrix == RIGHT_MATRIX and self.linear.masses is p.masses
        return not (p.stiff or self.damped or len(self.pins)) and usual

    def damper_rests(self, length: FloatArray) -> FloatArray:
        """Return the lengths at which dampers are at rest, as the springs have them at the start.

        Those of a fault may depend on the present lengths.
        """
        p, x, v, h = self.start.p, self.start.x, self.start.v, self.start.h
        if p.damper_rest is None:
            return self._lengths
        return p.damper_rest(p, l=length, x=x, v=v, h=h, x0=p.positions, y=self.y)

    @cached_property
    def _lengths(self) -> FloatArray:
        return frames(self.start.p, self.start.x)[0]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Return M (x - y) - h² f(x), shape (particle, 3)."""
        p, h = self.start.p, self.start.h
        f = self.constant + spring_forces(p, x)
        if self.damped and self.by_length:
            length, u = frames(p, x)
            rate = (length - self.damper_rests(length)) / h
            pull = p.damper_pull(p, l=length, rate=rate) if p.damper_pull else p.dampings * rate
            f = f - p.pulled.T @ (pull[:, None] * u)
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
        p, h = self.start.p.merit or self.start.p, self.start.h
        length, _ = frames(p, x)
        energy = 0.5 * (p.stiffnesses * stretches(p, length) ** 2).sum()
        if self.damped:
            energy += 0.5 / h * (p.dampings * (length - self.damper_rests(length)) ** 2).sum()
        penalty = 0.5 * self.hold * ((x - p.positions)[self.pins] ** 2).sum()
        inertia = 0.5 * (p.inertia * (x - self.y) ** 2).sum()
        return float(inertia + h * h * (energy - (self.constant * x).sum()) + penalty)

    def blocks(self, x: FloatArray, kind: str) -> tuple[FloatArray, FloatArray | None]:
        """Return the springs' 3 x 3 stiffnesses and their dampers', shape (spring, 3, 3)."""
        p = self.linear
        length, u = frames(p, x)
        uu = u[:, :, None] * u[:, None, :]
        k = p.stiffnesses if self.start.model.matrix.stiffness else np.ones(len(u))
        k = np.where(p.tension_only & (length <= p.rest_lengths), 0.0, k)
        safe = np.maximum(length, 1e-150)
        along, across = HESSIANS[kind](p.rest_lengths / safe, safe)
        springs = _isotropic(k * across) + (k * (along - across))[:, None, None] * uu
        return springs, self._damper_blocks(x, kind, uu, u, safe) if self.damped else None

    def _damper_blocks(
        self, x: FloatArray, kind: str, uu: FloatArray, u: FloatArray, length: FloatArray
    ) -> FloatArray:
        p = self.linear
        c = (p.dampings / self.start.h)[:, None, None]
        if self.by_length:
            _, across = HESSIANS[kind](self.damper_rests(length) / length, np.ones_like(length))
            return c * (_isotropic(across) + (1.0 - across)[:, None, None] * uu)
        if p.damping != "along":
            return c * np.tile(np.eye(3), (len(u), 1, 1))
        if kind != "exact":
            return c * uu
        # The derivative of (w·u) u by w, the relative displacement, and by u.
        w, normal = p.incidence @ (x - self.start.x), np.eye(3) - uu
        w_normal = np.einsum("sab,sb->sa", normal, w)
        turning = (w * u).sum(1)[:, None, None] * normal + u[:, :, None] * w_normal[:, None, :]
        return c * (uu + turning / length[:, None, None])

    def matrix(self, x: FloatArray, kind: str) -> FloatArray:
        """Return the matrix of a Newton step, (3 particle, 3 particle), as the model has it."""
        return self.put_together(*self.blocks(x, kind))

    def put_together(self, springs: FloatArray, dampers: FloatArray | None = None) -> FloatArray:
        """Return M + h² times the blocks of springs and dampers, or a faulty solver's version."""
        p, model = self.linear, self.start.model
        rule = model.matrix
        h = p.h_before / model.substeps if model.time == "before" else self.start.h
        h = h if rule.h == "h" else float(self.start.value(rule.h))
        if not rule.components:
            springs = springs * np.eye(springs.shape[1])
            if dampers is not None and not model.dampers_apart:
                dampers = dampers * np.eye(springs.shape[1])
        is_apart = model.dampers_apart or rule.damper_power or rule.dampers != "D"
        if dampers is not None and not is_apart:
            springs, dampers = springs + dampers, None
        A = rule.sign * h**rule.power * _assemble(p, springs, rule)
        if dampers is not None:
            D = evaluate(rule.dampers, p, {"D": _assemble(p, dampers)})
            A += h ** (2 + rule.damper_power) * D
        size = springs.shape[1]
        A.flat[:: len(A) + 1] += rule.masses * np.broadcast_to(p.inertia, (p.count, size)).ravel()
        if rule.filled != "A":
            A = evaluate(rule.filled, p, {"A": A})
        if self.hold:
            rows = (self.pins[:, None] * size + np.arange(size)).ravel()
            A[rows, rows] += self.hold
        return A

    def solve(
        self, A: FloatArray, right: FloatArray, guess: FloatArray | None = None
    ) -> FloatArray:
        """Return A^-1 right over the free particles, zero elsewhere, shape (particle, 3).

        Iterative solvers begin at a guess, by default zero.
        """
        free = self.free.ravel() if len(A) == 3 * len(right) else self.free.all(axis=1)
        if self.start.model.pins == "held on the right":
            right = right.copy()
            right[self.start.p.pinned] = 0.0
        if self.start.model.pins == "identity rows":
            rows = np.isin(np.arange(len(A)) * len(right) // len(A), self.start.p.pinned)
            A = np.where(rows[:, None], np.eye(len(A)), A)
        part = A if free.all() else A[np.ix_(free, free)]
        solution, b = np.zeros_like(right).reshape(len(A), -1), right.reshape(len(A), -1)
        wrong_rows = self.start.model.pins if self.start.model.pins in ROW_MISTAKES else ""
        b = b[free] if wrong_rows in ("", ROW_MISTAKES[0]) else b[: len(part)]
        kind, inverse = self.start.model.factorisation, self.start.model.matrix.inverse
        if inverse.startswith("factors"):
            lost, formula = inverse.removeprefix("factors ").split(" ", 1)
            values = {**_factors(part, int(lost)), "b": b}
            solution[free] = evaluate(formula, self.start.p, values)
        elif inverse != "exact":
            method, count = inverse.rsplit(" ", 1)
            x = solution if guess is None else guess.reshape(len(A), -1)
            solution[free] = nth(ITERATIONS[method](part, b, x[free]), int(count))
        elif kind != "LU" and not is_positive_definite(part):
            if kind == "change of velocity":
                return np.where(self.free, self.start.h * self.start.v, 0.0)
            if kind == "displacement":
                return np.zeros_like(right)
            L = stopped_cholesky(part)
            solution[free] = np.linalg.solve(L @ L.T, b)
        else:
            solution[free] = np.linalg.solve(part, b)
        if wrong_rows in (ROW_MISTAKES[0], ROW_MISTAKES[2]):
            rows = np.vstack([solution[free], solution[~free]])  # of pins it is zero
            solution = np.where(np.reshape(free, (-1, 1)), rows, 0.0)
        return solution.reshape(right.shape)

    def newton_step(self, A: FloatArray, right: FloatArray, drift: FloatArray) -> FloatArray:
        """Return the displacement of an iteration from its linear system."""
        if self.start.model.matrix.inverse == "first order":
            right = np.where(self.free, right, 0.0)
            M = self.start.p.inertia_diagonal
            step = right.ravel() / M
            step -= (A @ step - M * step) / M
            step = step.reshape(right.shape)
        else:
            step = self.solve(A, right)
        return np.where(self.free, drift + step, 0.0)

    def linear_system(
        self, x: FloatArray, base: FloatArray, kind: str
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the matrix, with the Hessian of a base, the right-hand side, and a displacement.

        That is what the solution lacks: h v where the unknown is a change of velocity, times h.
        """
        springs, dampers = self.blocks(base, kind)
        A, right = self.put_together(springs, dampers), -self.gradient(x)
        p, rule, h = self.start.p, self.start.model.matrix, self.start.h
        drift = np.zeros_like(right)
        if self.start.model.dv:
            drift = h * self.start.v
            if self.start.model.frames.get("matrix"):  # the right-hand side is of this step
                springs = self.blocks(x, kind)[0]
            K = _assemble(p, springs * np.eye(3) if not rule.components else springs,
                          RIGHT_MATRIX if rule.is_drag_right else rule)  # fmt: skip
            drag = rule.drag * h ** (2 + rule.drag_power) * K @ drift.ravel()
            right = right - p.inertia * drift - drag.reshape(right.shape)
            right = right + h**2 * damper_forces(p, x, self.start.v) if self.damped else right
        right = right * h**rule.right_power if rule.right_power else right
        right = right.T.reshape(right.shape) if rule.is_by_columns else right
        return A, right, drift


def is_positive_definite(A: FloatArray) -> bool:
    """Return whether Cholesky's method factorises a symmetric matrix."""
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        return False
    return True


def stopped_cholesky(A: FloatArray) -> FloatArray:
    """Return the lower triangle that Eigen's dense LLT leaves where a pivot is not positive.

    Columns before that pivot, or their part within its block, are those of L; the others are still
    of A, less what earlier blocks have taken off. Matrices below 32 rows are one block.
    """
    L, n = np.tril(A), len(A)
    block = n if n < 32 else min(max(n // 8 // 16 * 16, 8), 128)
    for first in range(0, n, block):
        end = min(first + block, n)
        for j in range(first, end):
            row = L[j, first:j]
            pivot = L[j, j] - row @ row
            if pivot <= 0.0:
                return L
            L[j, j] = np.sqrt(pivot)
            L[j + 1 : end, j] = (L[j + 1 : end, j] - L[j + 1 : end, first:j] @ row) / L[j, j]
        L[end:, first:end] = np.linalg.solve(L[first:end, first:end], L[end:, first:end].T).T
        L[end:, end:] -= np.tril(L[end:, first:end] @ L[end:, first:end].T)
    return L


# The shares of a spring's stiffness along and across it, given r/l and l: 1 and 1 - r/l are exact.
HESSIANS: Mapping[
    str, Callable[[FloatArray, FloatArray], tuple[FloatArray | float, FloatArray]]
] = {
    "exact": lambda ratio, length: (1.0, 1.0 - ratio),
    "frozen": lambda ratio, length: (1.0, 1.0 - ratio),
    "gauss": lambda ratio, length: (1.0, 0.0 * ratio),
    "projected": lambda ratio, length: (1.0, np.maximum(1.0 - ratio, 0.0)),
    "flipped": lambda ratio, length: (1.0, ratio - 1.0),
    "transverse": lambda ratio, length: (0.0, 1.0 - ratio),
    "inverted": lambda ratio, length: (1.0, 1.0 - 1.0 / np.maximum(ratio, 1e-150)),
    "added": lambda ratio, length: (1.0, 1.0 + ratio),
    "isotropic": lambda ratio, length: (1.0, 1.0 + 0.0 * ratio),
    "unscaled": lambda ratio, length: (length**2 * ratio + 1.0 - ratio, 1.0 - ratio),
}


def _jacobi(A: FloatArray, b: FloatArray, x: FloatArray) -> Iterator[FloatArray]:
    while True:
        yield x
        x = x + (b - A @ x) / np.diag(A)[:, None]


def _gauss_seidel(A: FloatArray, b: FloatArray, x: FloatArray) -> Iterator[FloatArray]:
    lower = np.tril(A)
    while True:
        yield x
        x = x + np.linalg.solve(lower, b - A @ x)


def conjugate_gradients(
    A: FloatArray,
    b: FloatArray,
    x: FloatArray,
    scale: FloatArray | float = 1.0,
    beta: Callable[[FloatArray, FloatArray], FloatArray] = lambda before, after: after / before,
) -> Iterator[FloatArray]:
    """Yield the iterates, preconditioned by a diagonal, or a matrix; each column on its own.

    β follows from r·z before and after a step.
    """
    is_matrix = np.shape(scale) == A.shape
    residual, direction, before = b - A @ x, 0.0 * b, np.ones(b.shape[1])
    while True:
        yield x
        z = np.asarray(np.linalg.solve(scale, residual) if is_matrix else residual / scale)
        after = (residual * z).sum(0)
        direction = z + beta(before, after) * direction if direction.any() else z
        image = A @ direction
        curvature = (direction * image).sum(0)  # negative where the matrix is indefinite
        rate = np.where(curvature != 0.0, after / np.where(curvature, curvature, 1.0), 0.0)
        x, residual, before = x + rate * direction, residual - rate * image, after


# Iterative solutions of A x = b from a guess.
ITERATIONS: Mapping[str, Callable[[FloatArray, FloatArray, FloatArray], Iterator[FloatArray]]] = {
    "Jacobi": _jacobi,
    "Gauss-Seidel": _gauss_seidel,
    "conjugate gradient": conjugate_gradients,
}


def nth(iterates: Iterator[FloatArray], count: int) -> FloatArray:
    """Return the iterate after so many iterations, the last one if there are fewer."""
    return deque(islice(iterates, count + 1), maxlen=1)[0]


def _factors(A: FloatArray, lost: int) -> dict[str, FloatArray]:
    """Return L and D of A = L D L'; `lost` terms are missing in each inner product."""
    L, D = np.eye(len(A)), np.zeros((len(A), 1))
    for i in range(len(A)):
        row = A[i, :i].copy()
        for j in range(i):
            row[j] -= row[: max(j - lost, 0)] @ L[j, : max(j - lost, 0)]
        L[i, :i] = row / D[:i, 0]
        D[i] = A[i, i] - row @ L[i, :i]
    return {"L": L, "D": D}


def _isotropic(scale: FloatArray) -> FloatArray:
    return scale[:, None, None] * np.eye(3)


def _assemble(
    p: SpringProblem, blocks: FloatArray, rule: SystemMatrix = RIGHT_MATRIX
) -> FloatArray:
    """Return the sum over springs of (A_i A_i') x block, (size particle, size particle)."""
    n, size = p.count, blocks.shape[1]
    first, second = np.maximum(p.incidence, 0.0), np.maximum(-p.incidence, 0.0)
    of_first, of_second, from_first, from_second = rule.element
    usual = rule.element == RIGHT_MATRIX.element
    columns = [p.incidence] if usual else [of_first * first + of_second * second]
    rows = [p.pulled.T] if usual else [np.where(p.incidence > 0.0, p.pulled, 0.0).T]
    if not usual:
        columns.append(from_first * first + from_second * second)
        rows.append(-np.where(p.incidence < 0.0, p.pulled, 0.0).T)
    total = np.zeros((n, n * size * size))
    for row, column in zip(rows, columns, strict=True):
        right = (column[:, :, None, None] * blocks[:, None]).reshape(len(blocks), -1)
        total += row @ right
    sums = total.reshape(n, n, size, size)
    if rule.diagonal != "sum":
        ends, at = np.zeros((2, n, size, size)), np.arange(n)
        for number, block in zip(p.springs, blocks, strict=True):
            ends[(0, 1) if rule.diagonal == "last of each end" else 0, number] = block
        sums[at, at] = ends.sum(axis=0)
    return np.ascontiguousarray(sums.transpose(0, 2, 1, 3)).reshape(size * n, size * n)


def _implicit(equation: StepEquation) -> FloatArray:
    """Return the positions at the end of an implicit step."""
    start, free = equation.start, equation.free
    integrator = start.model.integrator
    x = np.where(free, equation.starts[integrator.start], start.x)
    if equation.uncoupled:  # g is quadratic: each iteration leaves the same share of the way
        minimum = equation.y + equation.fall
        scale = start.p.inertia if integrator.method == "descent" else 1.0
        remainder = (1.0 - integrator.rate * scale) ** integrator.iterations
        return np.where(free, minimum + remainder * (x - minimum), x)
    if integrator.method == "converged":
        return _converged(equation, x)
    return nth(ITERATES[integrator.method](equation, x), integrator.iterations)


def _newton(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    start, first = equation.start, x
    integrator, decrease = start.model.integrator, start.model.integrator.decrease
    free = np.ix_(*2 * [equation.free.ravel()])
    while True:
        yield x
        at = first if integrator.is_stale else x
        base = first if integrator.hessian == "frozen" else x
        base = start.p.positions if "matrix" in start.model.frames else base
        system = equation.linear_system(at, base, integrator.hessian)
        if decrease is not None and not is_positive_definite(system[0][free]):
            system = equation.linear_system(at, base, "projected")
        step = equation.newton_step(*system)
        if decrease is None:
            x = x + integrator.rate * step
        elif (lower := _lower(equation, x, equation.free_gradient(x), step, decrease)) is None:
            return
        else:
            x = lower


def _local_global(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    """Solve (M + h²L) x_next = h² J d + M y + h² f_ext, pins moved to the right-hand side."""
    start, rule = equation.start, equation.start.model.matrix
    p, h, free = start.p, start.h, equation.free
    k, c = p.stiffnesses, (p.dampings / h if equation.damped else 0.0 * p.dampings)
    weights = equation.linear.stiffnesses if rule.stiffness else np.ones_like(k)
    c_matrix = c if equation.linear is p else equation.linear.dampings / h
    # components differ where they have masses of their own or are held apart
    is_by_component = 2 in (p.masses.ndim, equation.linear.masses.ndim)
    is_by_component |= bool((free.any(axis=1) != free.all(axis=1)).any())
    unit = np.eye(3) if is_by_component else np.eye(1)
    blocks, c_blocks = weights[:, None, None] * unit, c_matrix[:, None, None] * unit
    A = equation.put_together(blocks, c_blocks if equation.damped else None)
    pinned_x = np.where(free | (start.model.pins == "origin"), 0.0, x)
    of_pins = A
    if rule.pins_element is not None:
        springs = (k + c)[:, None, None] * unit
        of_pins = h * h * _assemble(p, springs, SystemMatrix(element=rule.pins_element))
    fixed = p.inertia * equation.y + h * h * equation.constant
    fixed -= (of_pins @ pinned_x.reshape(len(A), -1)).reshape(x.shape)
    fixed[equation.pins] += equation.hold * p.positions[equation.pins]
    is_exact = rule.inverse == "exact" and not is_by_component
    inverse = equation.solve(A, np.eye(len(A))) if is_exact else A
    while True:
        yield x
        right = fixed + h * h * (p.pulled.T @ _projected(equation, k, c, x))
        x = np.where(free, inverse @ right if is_exact else equation.solve(A, right, x), x)


def _projected(equation: StepEquation, k: FloatArray, c: FloatArray, x: FloatArray) -> FloatArray:
    """Return k and c, of springs and of dampers, times the vectors that the local step finds."""
    p = equation.start.p
    length, u = frames(p, x)
    pull = k * stretches(p, length) if p.pull is None else p.pull(p, l=length, x=x)
    lengths_at_rest = equation.damper_rests(length)
    rests = c * lengths_at_rest
    if p.damper_pull is not None and equation.damped and p.normalised:
        rate = (length - lengths_at_rest) / equation.start.h
        rests = c * length - p.damper_pull(p, l=length, rate=rate)
    size = (k * length - pull + rests) * (1.0 if p.normalised else length)
    if p.damping == "all":
        edges = c[:, None] * (p.incidence @ equation.start.x)
        return edges + (k * length - pull)[:, None] * u
    return size[:, None] * u


def _descent(equation: StepEquation, x: FloatArray) -> Iterator[FloatArray]:
    while True:
        yield x
        x = x - equation.start.model.integrator.rate * equation.free_gradient(x)


def _converged(equation: StepEquation, x: FloatArray) -> FloatArray:
    """Minimise g by Newton's method with a shift and a line search, else solve by residuals.

    The matrix is always the right one, since it does not change the solution. From positions near
    that a long step, the first or the last, shows that they are not: it is the estimate.
    """
    start = equation.start
    right = StepEquation(start._replace(
        p=start.p.changed(linear=None), model=start.model._replace(matrix=RIGHT_MATRIX)
    ))  # fmt: skip
    best, stalled, near, step = np.inf, 0, start.near, np.zeros_like(x)
    x = x if near is None else np.where(equation.free, near, x)
    for iteration in range(MAX_ITERATIONS):
        gradient = equation.free_gradient(x)
        norm = _norm(gradient)
        stalled = 0 if norm < 0.5 * best else stalled + 1
        best = min(best, norm)
        if norm == 0.0 or not np.isfinite(norm):
            return x
        A = right.matrix(x, "exact")
        if equation.conservative:
            A = _shifted(equation, A)
        step = -right.solve(A, gradient)
        moved = x - equation.start.x
        if near is not None and not iteration and _norm(step) > ESTIMATED * _norm(moved):
            return x + step
        lower = _lower(equation, x, gradient, step, DECREASE)
        if lower is None or stalled > MAX_STALLED:
            break
        x = lower
    return x if near is None else x + step


def _norm(x: FloatArray) -> float:
    return float(np.sqrt((x * x).sum()))


def _shifted(equation: StepEquation, A: FloatArray) -> FloatArray:
    """Return A plus the least of some multiples of M that makes it positive definite."""
    free = np.ix_(*2 * [equation.free.ravel()])
    M = np.diag(equation.start.p.inertia_diagonal)
    shift = 0.0
    while shift < 1e12:
        if is_positive_definite((A + shift * M)[free]):
            break
        shift = max(1e-2, 4.0 * shift)
    return A + shift * M


def _lower(
    equation: StepEquation, x: FloatArray, gradient: FloatArray, step: FloatArray, decrease: float
) -> FloatArray | None:
    """Return x + t step with the largest t = 1, 1/2, ... that lowers g, or the residual, enough.

    It is None if no t does.
    """
    norm, slope = _norm(gradient), float((gradient * step).sum())
    is_conservative = equation.conservative or equation.start.p.merit is not None
    start_value = equation.value(x) if is_conservative else 0.0
    noise = 1e-13 * abs(start_value)  # rounding of g hides that it falls
    for t in 0.5 ** np.arange(40.0):
        trial = x + t * step
        if is_conservative:
            is_lower = equation.value(trial) <= start_value + decrease * t * slope + noise
        else:
            is_lower = _norm(equation.free_gradient(trial)) < (1.0 - decrease * t) * norm
        if is_lower:
            return trial
    return None


# The iterates of a method from a start, without end.
ITERATES: Mapping[str, Callable[[StepEquation, FloatArray], Iterator[FloatArray]]] = {
    "newton": _newton,
    "local_global": _local_global,
    "descent": _descent,
}
