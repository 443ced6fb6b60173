"""Follow the iterations of a step up to answers that are not converged.

An iteration that ends too early leaves one of its iterates. It shows what converged answers hide:
the matrix, the energy that a line search compares, and the test by which the iteration ends.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import groupby, islice, product
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence, with_code

from ..explain import either, ending_test
from ..judgement import LEAST_SHARE, Explanation
from .faults import EARLY_END, FOLLOWED_FAULTS, KEPT_DIRECTIONS, STEP_FAULTS
from .formulas import evaluate
from .laws import (
    IMPRECISE,
    ROUNDED,
    SOLVED,
    is_indefinite,
    relative_gap,
    rounding,
    stiffness_of,
)  # fmt: skip
from .model import (
    DECREASE,
    ITERATES,
    RIGHT_MATRIX,
    Integrator,
    StepEquation,
    StepModel,
    conjugate_gradients,
    first_equation,
    predicted,
)  # fmt: skip
from .model_search import LARGEST, Probe
from .options import Option, apply, read_table
from .problem import SpringProblem

# The most iterations that are followed; few solvers make more. Of other methods than Newton's it is
# that number and ten times the number of coordinates.
MAX_ITERATIONS = 100
# An answer is an iterate up to this share of its distance from the right positions.
SAME = 1e-5
# An iteration that moves by less than this share of the distance to an answer does not reach it.
STATIONARY = 1e-6
# A mistake must reproduce so many wrong answers, the smallest, before all are compared.
TRIALS = 3
EXPLANATIONS = 3
# Where iterations may begin if a greeting declares a start; many call s_n y.
STARTS: Mapping[str | None, Sequence[str]] = {
    None: ("y", "s_n", "x_n"), "y": ("y", "s_n"), "s_n": ("s_n",), "x_n": ("x_n",),
}  # fmt: skip
# Newton's method with the whole Hessian, and with less of it, which converges later.
RIGHT_NEWTONS = [Integrator("newton", hessian=h) for h in ("exact", "gauss", "projected")]
_TABLE = read_table("iterations.toml")
NAMES = {method: Sentence(entry["sentence"], {}) for method, entry in _TABLE["methods"].items()}
# What iterations may compare with a bound to end, one number for each iterate, and its words.
TESTS = [
    (partial(evaluate, entry["quantity"], None), None, Sentence(entry["sentence"], {}))
    for entry in _TABLE["tests"]
]


class FollowedMethod(NamedTuple):
    """A method with its iterations, right or with a mistake."""

    integrator: Integrator
    fault: Option | None = None

    @property
    def order(self) -> tuple[int, bool]:
        """When it is compared: right, then with one of a few mistakes, then with one of many."""
        rank = 0 if self.fault is None else 2 if self.fault.part else 1
        return rank, self.integrator.decrease is None


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
    """The iterates of a course up to an answer."""

    moves: FloatArray  # by how much a particle moves at most before each, and after the last [m]
    residuals: FloatArray
    energies: FloatArray
    is_early: bool  # whether the answer is wrong
    is_exhausted: bool  # whether there is no next iterate
    h: float  # [s]

    @property
    def is_moved(self) -> bool:
        """Whether the answer is not the start: many other mistakes leave that."""
        return len(self.moves) > 2


def explanation(
    options: Sequence[Option],
    probes: Sequence[Probe],
    start: str | None,
    epsilon: float,
    is_hasty: bool = False,
    least_error: float = IMPRECISE,
) -> Explanation | None:
    """Return the mistake of the iteration that leaves the wrong answers, None if none is known.

    It is None where no error is larger than `least_error` of the displacement.
    In haste, where few answers are right, none of the many mistakes of Newton's method is sought.
    Iterations without a mistake that end by no known test give way to those with one.
    """
    trials = trials_of(options, probes, epsilon)
    wrong = [trial for trial in trials if trial.error > SOLVED and not trial.is_unlike]
    wrong.sort(key=lambda trial: (is_indefinite(trial.problem), trial.problem.count))
    if not any(trial.error > least_error for trial in wrong):
        return None
    is_hasty &= len(wrong) > (1.0 - LEAST_SHARE) * len(trials)
    _, model = apply(options, trials[0].problem, StepModel(damper="none"))
    courses, vague = sorted(_courses(model, STARTS[start]), key=lambda c: c.order), None
    for _, group in groupby(courses, key=lambda c: c.order):
        matches: dict[str, FollowedMethod] = {}
        for course in group:
            key = course.fault.key if course.fault else EARLY_END["key"]
            is_tried = not is_hasty or course.fault in (None, *FOLLOWED_FAULTS)
            first = [_track(options, t, course) for t in wrong[:TRIALS]] if is_tried else []
            if first and all(first) and any(track.is_moved for track in first if track):
                matches.setdefault(key, course)
        if matches:
            tracks = {key: [_track(options, t, c) for t in trials] for key, c in matches.items()}
            found = _explanation(matches, tracks, trials)
            is_clear = any(c.fault or _ending(tracks[key]) for key, c in matches.items())
            if is_clear and (vague is None or (found and found.share > vague.share)):
                return found
            vague = vague or found
    return vague


def stiffness_hint(
    options: Sequence[Option], probes: Sequence[Probe], epsilon: float
) -> Sentence | None:
    """Return that answers are right except where the system is stiff, None if they are not."""
    trials = [t for t in trials_of(options, probes, epsilon) if not is_indefinite(t.problem)]
    right = [stiffness_of(t.problem) for t in trials if t.error <= IMPRECISE]
    wrong = [stiffness_of(t.problem) for t in trials if t.error > IMPRECISE]
    if not right or not wrong or max(right) >= min(wrong):
        return None
    _, model = apply(options, trials[0].problem, StepModel(damper="none"))
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


def trials_of(
    options: Sequence[Option], probes: Sequence[Probe], epsilon: float
) -> list[StepAnswer]:
    """Return the answers as single steps."""
    return [_trial(options, epsilon, probe) for probe in probes if "positions" in probe.answers]


def _trial(options: Sequence[Option], epsilon: float, probe: Probe) -> StepAnswer:
    """Return the answer to a single step, or to the first of several."""
    problem = probe.problem.changed(steps=None)
    positions = probe.answers["positions"].reshape(-1, problem.count, 3)[0]
    p, model = apply(options, problem, StepModel(damper="none"))
    expected, allowed = predicted(p, model, positions), rounding(p, model, epsilon)
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
        own = {"velocities": (positions - problem.positions) / problem.h * model.scaling}
        is_unlike = relative_gap(problem, own, velocities, allowed) > IMPRECISE
    return StepAnswer(problem, positions, error, 4.0 * allowed.positions + bound, is_unlike)


def _explanation(
    courses: Mapping[str, FollowedMethod],
    tracks: Mapping[str, Sequence[Track | None]],
    trials: Sequence[StepAnswer],
) -> Explanation | None:
    """Return the courses, by keys, that have most answers among their iterates.

    Their share is that of all answers or, if less, of the wrong answers.
    """
    wrong, shares = np.array([trial.is_wrong for trial in trials]), dict[str, float]()
    for key, row in tracks.items():
        pairs = zip(row, trials, strict=True)
        hits = np.array([track is not None and not trial.is_unlike for track, trial in pairs])
        shares[key] = min(hits.mean(), hits[wrong].mean())
    share = float(max(shares.values()))
    keys = [key for key in shares if shares[key] == share][:EXPLANATIONS]
    words = [[_words(courses[key], tracks[key])] for key in keys]
    return Explanation(tuple(keys), either(words), share, 0.0) if share >= LEAST_SHARE else None


def _words(course: FollowedMethod, tracks: Sequence[Track | None]) -> Sentence:
    """Return the mistake of a course, and the test by which it ends early."""
    early = [track for track in tracks if track is not None and track.is_early]
    ends, test = [len(track.residuals) - 1 for track in early], _ending(tracks)
    if test is None and min(ends) == max(ends):
        test = sentence("after {count} iterations", count=ends[0])
    elif test is None:
        test = sentence("after {low} to {high} iterations", low=min(ends), high=max(ends))
    name = NAMES[course.integrator.method]
    values = {"name": name, "test": test, "count": len(ends), "total": len(tracks)}
    if course.integrator.method == "local_global" and set(ends) == {1}:
        kept = with_code(KEPT_DIRECTIONS["code"], Sentence(KEPT_DIRECTIONS["sentence"], {}))
        return sentence("{fault} This is so in {count} of {total} answers.", fault=kept, **values)
    if course.fault is None:
        ended = with_code(EARLY_END["code"], Sentence(EARLY_END["sentence"], {}))
        return sentence(
            "{fault} Those of {name} end {test}, and too early in {count} of {total} answers.",
            fault=ended, **values,
        )  # fmt: skip
    return sentence(
        "{fault} So the iterations of {name} do not converge in {count} of {total} answers: they "
        "end {test}.", fault=course.fault.sentence, **values,
    )  # fmt: skip


def _ending(tracks: Sequence[Track | None]) -> Sentence | None:
    """Return the test by which iterations end early, None if it is unknown."""
    followed = [track for track in tracks if track is not None]
    if all(track.is_exhausted for track in followed if track.is_early):
        return sentence("when their line search finds no lower energy")
    is_early = [track.is_early for track in followed]
    return ending_test(TESTS, [track._asdict() for track in followed], is_early)


def _delay(fault: Option) -> Any:
    """Return the part of a fault that may delay Newton's method: itself, or its integrator."""
    integrator = fault.fields.get("integrator")
    if integrator is not None:
        integrator = integrator._replace(iterations=1, start="x_n")
        is_other = integrator.method == "newton" and integrator not in RIGHT_NEWTONS
        return integrator if is_other else None
    is_meant = fault.aspect == "matrix" or fault.part in ("forces", "matrix", "energy")
    return id(fault) if is_meant and "dv" not in fault.fields else None


DELAYS = {_delay(fault): fault for fault in reversed((*FOLLOWED_FAULTS, *STEP_FAULTS))}
DELAYS.pop(None)
# Wrong β of conjugate gradients, and matrices that are not symmetric: they do not converge.
LINEAR = [
    fault
    for fault in (*FOLLOWED_FAULTS, *STEP_FAULTS)
    if fault.fields.get("matrix", RIGHT_MATRIX).is_skew
    or fault.fields.get("integrator", RIGHT_NEWTONS[0]).method == "linear"
]
FACTORISATIONS = [fault for fault in STEP_FAULTS if fault.aspect == "factorisation"]


def _courses(model: StepModel, starts: Sequence[str]) -> Iterator[FollowedMethod]:
    """Yield the methods that a model may stand for, right and with mistakes."""
    method, right = model.integrator.method, model.integrator._replace(method="linear")
    if method == "newton" and right.iterations == 1:
        for fault, scale, start in product([None, *LINEAR], _TABLE["scales"], ("x_n", "y")):
            beta = fault.fields.get("integrator", right).beta if fault else right.beta
            yield FollowedMethod(right._replace(start=start, scale=scale, beta=beta), fault)
        yield from (FollowedMethod(model.integrator, fault) for fault in FACTORISATIONS)
        return
    if method in ("local_global", "converged"):
        yield from (FollowedMethod(Integrator("local_global", start)) for start in starts)
    is_newton = method in ("newton", "converged")
    for start, decrease in product(starts if is_newton else (), (DECREASE, None)):
        for newton in RIGHT_NEWTONS:
            yield FollowedMethod(newton._replace(start=start, decrease=decrease))
        for fault in DELAYS.values():
            changed = fault.fields.get("integrator", RIGHT_NEWTONS[0])._replace(start=start)
            if changed.decrease is None:
                changed = changed._replace(decrease=decrease)
            if decrease is not None or (fault.part != "energy" and changed.decrease is None):
                yield FollowedMethod(changed, fault)


def _track(options: Sequence[Option], trial: StepAnswer, course: FollowedMethod) -> Track | None:
    """Return the iterates up to an answer, None if it is not among them."""
    equation = _equation(course, options, trial.problem)
    is_slow = course.integrator.method != "newton"
    limit = MAX_ITERATIONS + 10 * trial.positions.size * is_slow
    start = np.where(equation.free, equation.starts[course.integrator.start], equation.start.x)
    xs = list[FloatArray]()
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        iterates, residual = _iteration(equation, start)
        for x in islice(iterates, 1 + limit):
            move = np.abs(x - xs[-1]).max() if xs else np.inf
            xs.append(x)
            gap = np.abs(x - trial.positions).max()
            if gap <= trial.bound:
                break
            if move < STATIONARY * gap or not gap < LARGEST:
                return None
        else:
            return None
        following = next(iterates, None)
        moves = np.diff([*xs, xs[-1] if following is None else following], axis=0)
        return Track(
            np.append(np.inf, np.linalg.norm(moves, axis=-1).max(axis=-1)),
            np.array([np.linalg.norm(residual(x)) for x in xs]),
            np.array([equation.value(x) for x in xs]),
            trial.error > SOLVED,
            following is None,
            equation.start.h,
        )
    return None


def _equation(
    course: FollowedMethod, options: Sequence[Option], problem: SpringProblem
) -> StepEquation:
    """Return the equation of a course; its line search may compare another energy."""
    usual, model = p, _ = apply(options, problem, StepModel(damper="none"))
    if course.fault is not None:
        part = course.fault.part
        fault = course.fault._replace(part=part.removeprefix("energy"))
        p, model = apply([*options, fault], problem, StepModel(damper="none"))
        if part in ("energy", "forces"):
            p = usual.changed(merit=p) if part == "energy" else p.changed(merit=usual)
    return first_equation(p, model._replace(integrator=course.integrator))


def _iteration(
    equation: StepEquation, start: FloatArray
) -> tuple[Iterator[FloatArray], Callable[[FloatArray], FloatArray]]:
    """Return the iterates from a start, and the residuals that they leave."""
    p, model, x_n, _, _, _ = equation.start
    free, integrator = equation.free.ravel(), model.integrator
    if integrator.method != "linear":
        return ITERATES[integrator.method](equation, start), equation.free_gradient
    A, right, drift = equation.linear_system(x_n, x_n, integrator.hessian)
    base = np.where(equation.free, x_n + drift, x_n)
    usual = StepEquation(equation.start._replace(model=model._replace(matrix=RIGHT_MATRIX)))
    diagonal = usual.matrix(x_n, integrator.hessian).diagonal()[free]
    A, b = A[np.ix_(free, free)], right.reshape(-1, 1)[free]
    particle = np.arange(len(free))[free] // 3
    diagonals = {"A": A, "M": p.inertia_diagonal[free], "diagonal": diagonal,
                 "blocks": A * (particle[:, None] == particle)}  # fmt: skip
    scale = evaluate(integrator.scale, p, diagonals)
    is_matrix = scale.ndim == 2
    scale = scale if is_matrix else scale[:, None]
    root = np.linalg.cholesky(scale) if is_matrix else scale**0.5

    def beta(before: FloatArray, after: FloatArray) -> Any:
        return evaluate(integrator.beta, p, {"before": before, "after": after})

    def residual(x: FloatArray) -> FloatArray:
        left = b - A @ (x - base).reshape(-1, 1)[free]
        return np.linalg.solve(root, left) if is_matrix else left / root

    def placed(solution: FloatArray) -> FloatArray:
        step = np.zeros(len(free))
        step[free] = solution[:, 0]
        return base + step.reshape(x_n.shape)

    guess = (start - base).reshape(-1, 1)[free]
    return map(placed, conjugate_gradients(A, b, guess, scale, beta)), residual
