"""Follow the iterations of a step up to answers that are not converged.

The answer of iterations with an early end is an iterate. It shows what converged answers hide: the
test by which the iteration ends.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import islice, product, takewhile
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence, with_code

from ..explain import ending_test
from ..fault_programs import coded_faults
from ..judgement import LEAST_SHARE, Explanation
from .laws import IMPRECISE, ROUNDED, SOLVED, is_indefinite, relative_gap, rounding, stiffness_of
from .model import (
    HESSIANS,
    ITERATES,
    Integrator,
    StepEquation,
    StepModel,
    first_equation,
    predicted,
)
from .model_search import LARGEST, Probe
from .problem import SpringProblem

# The most iterations that are followed; few solvers make more. Methods other than Newton's have
# this number and ten times the number of coordinates.
MAX_ITERATIONS = 100
# An answer is an iterate up to this share of its distance from the right positions.
SAME = 1e-5
# An iteration below this share of the distance to an answer does not reach the answer.
STATIONARY = 1e-6
# A method must reproduce so many wrong answers, the smallest, before all are compared.
TRIALS = 3
# The codes of iterations that end too early, and of a single local/global iteration.
EARLY_END, KEPT_DIRECTIONS = "PB-STEP-168", "PB-STEP-183"
# Where iterations may begin if a greeting declares a start; many call s_n y.
STARTS: Mapping[str | None, Sequence[str]] = {
    None: ("y", "s_n", "x_n"), "y": ("y", "s_n"), "s_n": ("s_n",), "x_n": ("x_n",),
}  # fmt: skip
NAMES = {
    "newton": sentence("Newton's method"),
    "local_global": sentence("the local/global method"),
    "linear": sentence("conjugate gradients"),
}
# What preconditions conjugate gradients with the matrix A, by the name in place of a Hessian's.
SCALES: Mapping[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "nothing": lambda A, masses: np.eye(len(A)),
    "masses": lambda A, masses: np.diag(masses),
    "diagonal": lambda A, masses: np.diag(np.diag(A)),
    "blocks": lambda A, masses: A * np.kron(np.eye(len(A) // 3), np.ones((3, 3))),
}
# What iterations may compare with a bound to end, one number for each iterate of a track, and its
# words.
TESTS: Sequence[tuple[Callable[[Any], Any], None, Sentence]] = (
    (lambda t: -np.arange(len(t.residuals)), None,
     sentence("after iteration {iterations}, whatever is left")),
    (lambda t: t.moves, None,
     sentence("when no particle moves by more than about {bound:.2g} m")),
    (lambda t: t.residuals / max(t.residuals[0], 1e-300), None,
     sentence("when the residual is below about {bound:.2g} of the first one")),
    (lambda t: t.residuals, None,
     sentence("when the residual is below about {bound:.2g} kg m")),
    (lambda t: t.residuals / t.h, None,
     sentence("when the residual of the equation for the change of velocity is below about "
              "{bound:.2g}, whatever it was first")),
)  # fmt: skip


class StepAnswer(NamedTuple):
    """An answer to a single step, or to the first of several."""

    problem: SpringProblem
    positions: FloatArray
    error: float  # from the right positions, relative to the displacement
    bound: float  # up to this distance an iterate is the answer [m]
    is_unlike: bool = False  # whether velocities are not (x' - x) / h, as the model has them

    @property
    def is_wrong(self) -> bool:
        """Whether positions or velocities are wrong."""
        return self.is_unlike or self.error > SOLVED


class Track(NamedTuple):
    """The iterates of a method up to an answer."""

    moves: FloatArray  # by how much a particle moves at most before each [m]
    residuals: FloatArray
    is_early: bool  # whether the answer is wrong
    h: float  # [s]


def explanation(
    model: StepModel, probes: Sequence[Probe], start: str | None, epsilon: float
) -> Explanation | None:
    """Return the explanation by early ends if all wrong answers are iterates, else None.

    It is None where no error is larger than `IMPRECISE` of the displacement. Iterations without a
    known test at their end give way to iterations with a test.
    """
    trials = trials_of(model, probes, epsilon)
    wrong = [trial for trial in trials if trial.error > SOLVED and not trial.is_unlike]
    wrong.sort(key=lambda trial: (is_indefinite(trial.problem), trial.problem.count))
    if not any(trial.error > IMPRECISE for trial in wrong):
        return None
    vague = None
    for integrator in _integrators(model, STARTS[start]):
        follow = partial(_track, model._replace(integrator=integrator))
        first = [track for track in takewhile(bool, map(follow, wrong[:TRIALS])) if track]
        # many other mistakes leave the start
        is_moved = any(len(track.moves) > 2 for track in first)
        if is_moved and len(first) == len(wrong[:TRIALS]):
            tracks = [follow(trial) for trial in trials]
            words = _explanation(integrator, tracks, trials)
            if words and _ending(tracks):
                return words
            vague = vague or words
    return vague


def stiffness_hint(model: StepModel, probes: Sequence[Probe], epsilon: float) -> Sentence | None:
    """Return that answers are right except where the system is stiff, None if they are not."""
    trials = [t for t in trials_of(model, probes, epsilon) if not is_indefinite(t.problem)]
    right = [s for t in trials if t.error <= IMPRECISE and (s := stiffness_of(t.problem)) > 0.0]
    wrong = [stiffness_of(t.problem) for t in trials if t.error > IMPRECISE]
    if not right or not wrong or max(right) >= min(wrong):
        return None
    is_linear = (model.integrator.method, model.integrator.iterations) == ("newton", 1)
    place = sentence(
        "the linear solver: its number of iterations, its end and, of conjugate gradients, α and β"
        if is_linear
        else "the iteration: its Hessian, its line search, its number of iterations and its end"
    )
    return sentence(
        "Its positions are right up to {small:.1g} of the displacement where the system is not "
        "stiff (h² k / m of all springs of a particle up to {low:.2g}), and off by {large:.1g} of "
        "it or more where it is stiff ({high:.2g}): the equation is right, but not solved. Look at "
        "{place}.",
        small=max(t.error for t in trials if t.error <= IMPRECISE), low=max(right),
        large=min(t.error for t in trials if t.error > IMPRECISE), high=min(wrong), place=place,
    )  # fmt: skip


def trials_of(model: StepModel, probes: Sequence[Probe], epsilon: float) -> list[StepAnswer]:
    """Return the answers as single steps."""
    return [_trial(model, epsilon, probe) for probe in probes if "positions" in probe.answers]


def _trial(model: StepModel, epsilon: float, probe: Probe) -> StepAnswer:
    """Return the answer to a single step, or to the first of several."""
    problem = probe.problem.changed(steps=None)
    positions = probe.answers["positions"].reshape(-1, problem.count, 3)[0]
    expected = predicted(problem, model, positions)
    allowed = rounding(problem, model, epsilon)
    if not expected:
        return StepAnswer(problem, positions, np.inf, 0.0)
    gap = float(np.abs(expected["positions"] - positions).max())
    error = relative_gap(problem, expected, {"positions": positions}, allowed)
    error = error if gap > ROUNDED * allowed.positions else 0.0
    size = float(np.abs(positions - problem.positions).max())
    bound = SAME * gap if error > SOLVED else SOLVED * size
    is_unlike = False
    if "velocities" in probe.answers and (model.velocity, model.substeps) == ("displacement", 1):
        velocities = {"velocities": probe.answers["velocities"].reshape(-1, problem.count, 3)[0]}
        own = {"velocities": (positions - problem.positions) / problem.h * model.scaling.factor}
        is_unlike = relative_gap(problem, own, velocities, allowed) > IMPRECISE
    return StepAnswer(problem, positions, error, 4.0 * allowed.positions + bound, is_unlike)


def _explanation(
    integrator: Integrator, tracks: Sequence[Track | None], trials: Sequence[StepAnswer]
) -> Explanation | None:
    """Return the explanation of answers as iterates, by the lesser share of all or wrong."""
    wrong, pairs = np.array([trial.is_wrong for trial in trials]), zip(tracks, trials, strict=True)
    hits = np.array([track is not None and not trial.is_unlike for track, trial in pairs])
    share = float(min(hits.mean(), hits[wrong].mean()))
    code, message = _words(integrator, tracks)
    key = coded_faults()[code].name
    return Explanation((key,), message, share, 0.0) if share >= LEAST_SHARE else None


def _words(integrator: Integrator, tracks: Sequence[Track | None]) -> tuple[str, Sentence]:
    """Return the code of early ends of iterations, and the test at these ends."""
    early = [track for track in tracks if track is not None and track.is_early]
    ends, test = [len(track.residuals) - 1 for track in early], _ending(tracks)
    if test is None and min(ends) == max(ends):
        test = sentence("after {count} iterations", count=ends[0])
    elif test is None:
        test = sentence("after {low} to {high} iterations", low=min(ends), high=max(ends))
    is_single = integrator.method == "local_global" and set(ends) == {1}
    code = KEPT_DIRECTIONS if is_single else EARLY_END
    values = {
        "fault": with_code(code, coded_faults()[code].sentence),
        "name": NAMES[integrator.method], "test": test, "count": len(ends), "total": len(tracks),
    }  # fmt: skip
    if is_single:
        return code, sentence("{fault} This is so in {count} of {total} answers.", **values)
    return code, sentence(
        "{fault} Those of {name} end {test}, and too early in {count} of {total} answers.",
        **values,
    )


def _ending(tracks: Sequence[Track | None]) -> Sentence | None:
    """Return the test by which iterations end early, None if it is unknown."""
    followed = [track for track in tracks if track is not None]
    return ending_test(TESTS, followed, [track.is_early for track in followed])


def _integrators(model: StepModel, starts: Sequence[str]) -> Iterator[Integrator]:
    """Yield the methods with iterations that a model may stand for."""
    method = model.integrator.method
    if method == "newton" and model.integrator.iterations == 1:
        for scale, start in product(SCALES, ("x_n", "y")):
            yield Integrator("linear", start, hessian=scale)
        return
    if method == "converged" or (method == "local_global" and model.integrator.iterations > 1):
        yield from (Integrator("local_global", start) for start in starts)
    if method in ("newton", "converged"):
        for start, hessian in product(starts, HESSIANS):
            yield Integrator("newton", start, 1, hessian)


def _track(model: StepModel, trial: StepAnswer) -> Track | None:
    """Return the iterates up to an answer, None if the answer is no iterate."""
    equation = first_equation(trial.problem, model)
    is_slow = model.integrator.method != "newton"
    limit = MAX_ITERATIONS + 10 * trial.positions.size * is_slow
    start = np.where(equation.free, equation.starts[model.integrator.start], equation.start.x)
    xs, moves = list[FloatArray](), [np.inf]
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        iterates, residual = _iteration(equation, start)
        for x in islice(iterates, 1 + limit):
            if xs:
                moves.append(float(np.linalg.norm(x - xs[-1], axis=-1).max()))
            xs.append(x)
            gap = float(np.abs(x - trial.positions).max())
            if gap <= trial.bound:
                residuals = np.array([np.linalg.norm(residual(x)) for x in xs])
                return Track(np.array(moves), residuals, trial.error > SOLVED, equation.start.h)
            if moves[-1] < STATIONARY * gap or not gap < LARGEST:
                return None
    return None


def _iteration(
    equation: StepEquation, start: FloatArray
) -> tuple[Iterator[FloatArray], Callable[[FloatArray], FloatArray]]:
    """Return the iterates from a start, and their residuals."""
    p, model, x_n, _, _, _ = equation.start
    if model.integrator.method != "linear":
        return ITERATES[model.integrator.method](equation, start), equation.free_gradient
    free = np.repeat(equation.free.ravel(), 3)
    A = equation.matrix(x_n, "exact")[np.ix_(free, free)]
    b = -equation.gradient(x_n).ravel()[free]
    scale = SCALES[model.integrator.hessian](A, np.repeat(p.masses, 3)[free])
    root = np.linalg.cholesky(scale)

    def residual(x: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.solve(root, b - A @ (x - x_n).ravel()[free]))

    def placed(solution: FloatArray) -> FloatArray:
        step = np.zeros(len(free))
        step[free] = solution
        return x_n + step.reshape(x_n.shape)

    guess = (start - x_n).ravel()[free]
    return map(placed, _conjugate_gradients(A, b, guess, scale)), residual


def _conjugate_gradients(
    A: FloatArray, b: FloatArray, x: FloatArray, scale: FloatArray
) -> Iterator[FloatArray]:
    """Yield the iterates of conjugate gradients that a matrix preconditions."""
    residual: FloatArray = b - A @ x
    direction, before = 0.0 * b, 1.0
    while True:
        yield x
        z: FloatArray = np.asarray(np.linalg.solve(scale, residual), dtype=float)
        after = float(residual @ z)
        direction = z + after / before * direction if direction.any() else z
        image = A @ direction
        curvature = float(direction @ image)  # negative where the matrix is indefinite
        rate = after / curvature if curvature else 0.0
        x, residual, before = x + rate * direction, residual - rate * image, after
