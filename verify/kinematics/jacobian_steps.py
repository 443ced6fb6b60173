"""Recognise the steps of Jacobian methods, and the known mistakes in them.

An iteration rotates the joints of the path by J^T p, where (J J^T + m I) p = s e: damped least
squares (Wampler 1986), or p = s e: the transpose. J has three columns for each joint, and follows
from the pose before; p, m and s are computed from the rotations of the answer. Rotations that no p
explains come from another J, or from another use of the step.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise, permutations
from typing import Any, NamedTuple

import numpy as np
import scipy

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, with_code

from ..explain import either
from ..formulas import value_of
from ..greeting import Greeting
from ..judgement import Explanation, Verdict
from .faults import TABLE, SwitchFault, describe, switches
from .predictions import RIGHT, forward
from .sweeps import PoseTrial
from .switches import Switches

# Relative differences that rounding explains, and the least rotation of an iteration [rad].
SAME = {"double": 1e-6, "single": 1e-2}
LEAST_ANGLE = {"double": 1e-4, "single": 1e-2}
# The share of the iterations that a model explains, of which rotations beyond half a turn show
# nothing; the least number of iterations, and how many of the first a model may miss.
MIN_SHARE, MIN_COUNT, TRIAL = 0.6, 3, 4
# Steps along the error, as the transpose's, do not show the damping: the sine of their angle.
ALONG = 1e-3
# A bound of all rotations below this is too small for most solves [rad].
SMALL_BOUND = 0.1
MAX_ALTERNATIVES = 3
BISECTIONS = 60
# Iterations change nothing if fewer than this share of them do.
FEW_MOVED = 0.1
# Positions are those before an iteration up to this share of their change.
LATE = 1e-3
EARLIER = "positions of the iteration before"
UNMOVED, UNSOLVED = "iterations that change nothing", "wrong solution of the equation"
# Formulas of a right program, which those in the `models` of a fault replace. Of the path's joints
# but the effector there are the global rotations R, those of the parents P and the local ones Q as
# matrices, and as quaternions those before an iteration, g, p and q, and after it, g1, p1 and q1;
# of all joints of the path the positions x, in the first pose x0 and in the one before xp; and the
# target t.
FORMULAS: Mapping[str, Any] = {
    "pose": -2,  # that of the Jacobian: the one before the iteration; 0 is the first
    "axes": "R",  # the columns are the axes of the Jacobian's columns
    "arms": "x[-1] - x[:-1]",
    "columns": "k",  # the columns that rotate each joint, (joint, 3); -1 of none
    "increments": "mul(inv(q), q1)",  # the rotations that are made of the step
    "rule": "exponential",  # by which they are made of it
    "error": "t - x[-1]",
    # terms with M = J J^T, p and the error e: the first is a sum of the others with factors u
    "equation": ["M @ p", "e", "-p"],
    "condition": "0.0",  # what the factors have to make zero
}
# Where increments are applied, with the axes that go with it: own axes, the parent's, the world's.
PLACES: Sequence[Mapping[str, str]] = (
    {},
    {"axes": "P", "increments": "mul(q1, inv(q))"},
    {"axes": "I", "increments": "mul(mul(p, mul(q1, inv(q))), inv(p))"},
)
# Changes of the formulas, and the key of the mistake, "" of an honest program.
Model = tuple[str, Mapping[str, Any]]
HONEST: Sequence[Model] = (
    ("", {}),
    ("", {"axes": "I", "increments": "mul(mul(p1, mul(q1, inv(q))), inv(p1))"}),
    ("", {"rule": "first order"}),
    *(("", {**place, "rule": "".join(xyz)}) for place in PLACES for xyz in permutations("XYZ")),
)
HONEST_STEPS: Sequence[Model] = (("", {}), ("", {"equation": ["p", "e"]}))
OF_STEPS = {"error", "equation"}


def _with_entry(M: FloatArray, i: int, j: int, value: float) -> FloatArray:
    """Return a symmetric matrix with another number at i, j and at j, i."""
    M = M.copy()
    M[i, j] = M[j, i] = value
    return M


FUNCTIONS = {
    "np": np, "mul": rotation.multiply, "inv": rotation.conjugate, "I": np.eye(3),
    "with_entry": _with_entry,
}  # fmt: skip
ENTRIES: Mapping[str, Any] = TABLE["jacobian"]


class Iteration(NamedTuple):
    """An iteration of a solve."""

    solve: str  # the name of its first case
    target: FloatArray
    # positions and rotations of the path's joints in all poses from the start to its end, by names
    # in formulas
    poses: Sequence[Mapping[str, FloatArray]]
    answered: FloatArray | None = None  # the answer's positions of the path's joints
    cap: float = np.inf  # the angle at which some joints' rotations end [rad]

    @property
    def values(self) -> dict[str, FloatArray]:
        """The values of names in formulas, except for matrices."""
        after = {f"{name}1": array for name, array in self.poses[-1].items()}
        first, earlier = (self.pose(i)["x"] for i in (0, -3))
        return {**self.poses[-2], **after, "t": self.target, "x0": first, "xp": earlier}

    def pose(self, i: int) -> Mapping[str, FloatArray]:
        """Return the i-th pose, the first if there is none before."""
        return self.poses[max(i, -len(self.poses))]

    @property
    def approach(self) -> float:
        """How much nearer the effector comes to its target [m]."""
        before, after = (np.linalg.norm(self.pose(i)["x"][-1] - self.target) for i in (-2, -1))
        return float(before - after)

    @property
    def is_late(self) -> bool:
        """Whether the answer has the positions before the iteration, which changes them."""
        if self.answered is None:
            return False
        before, after = (self.pose(i)["x"] for i in (-2, -1))
        gap, change = (np.abs(x - before).max() for x in (self.answered, after))
        return bool(gap <= LATE * change)

    @property
    def angles(self) -> FloatArray:
        """The rotations of the joints [rad]."""
        before, after = (self.pose(i)["q"] for i in (-2, -1))
        return rotation.angle(before, after)

    @property
    def angle(self) -> float:
        """The largest rotation of a joint [rad]."""
        return float(self.angles.max(initial=0.0))


class Fit(NamedTuple):
    """The step that explains an iteration best."""

    iteration: Iteration
    J: FloatArray
    p: FloatArray
    gap: float  # relative, between the rotations and those of the step


class Solution(NamedTuple):
    """The equation of a step, solved for its factors."""

    step: Fit
    factors: FloatArray  # s and m
    gap: float  # relative

    @property
    def error(self) -> FloatArray:
        """The displacement from the effector to the target [m]."""
        return np.asarray(self.step.iteration.target - self.step.iteration.pose(-2)["x"][-1])

    @property
    def is_along(self) -> bool:
        """Whether the step is along the error, so that s and m are not known."""
        p, e = self.step.p, self.error
        return bool(np.linalg.norm(np.cross(p, e)) <= ALONG * np.linalg.norm(p) * np.linalg.norm(e))


def _value(formula: str, values: Mapping[str, Any]) -> Any:
    return value_of(formula, {**FUNCTIONS, **values})


def _least_squares(A: FloatArray, b: FloatArray) -> tuple[FloatArray, float]:
    """Return the solution of A x = b, and |A x - b| / |b|."""
    x = np.asarray(np.linalg.lstsq(A, b, rcond=None)[0], dtype=np.float64)
    return x, float(np.linalg.norm(A @ x - b) / max(float(np.linalg.norm(b)), 1e-300))


def fit(change: Mapping[str, Any], iteration: Iteration) -> Fit:
    """Return the step of a program with some formulas changed."""
    model, values = {**FORMULAS, **change}, iteration.values
    joints = iteration.pose(model["pose"])
    matrices = {name.upper(): rotation.to_matrix(joints[name]) for name in "pq"}
    R = rotation.to_matrix(joints["g"])
    of_pose = {**values, **joints, **matrices, "R": R}
    axes = np.broadcast_to(_value(model["axes"], of_pose), R.shape).swapaxes(1, 2)
    arms = np.broadcast_to(_value(model["arms"], of_pose), (len(R), 3))
    J = np.cross(axes, arms[:, None]).reshape(-1, 3).T
    columns = np.ravel(_value(model["columns"], {"k": np.arange(J.shape[1]).reshape(-1, 3)}))
    step = _numbers(model["rule"], _value(model["increments"], values)).ravel()
    A = np.where(columns >= 0, J[:, columns], 0.0).T
    whole, is_cut = _least_squares(A, step), iteration.angles >= iteration.cap
    if not is_cut.any() or is_cut.all():
        return Fit(iteration, J, *whole)
    part = _least_squares(*_without_lengths(A, step, is_cut))
    return Fit(iteration, J, *min(whole, part, key=lambda solution: solution[1]))


def _without_lengths(
    A: FloatArray, step: FloatArray, is_cut: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return A p = step in which some joints' rotation vectors show only their directions."""
    A, step = A.reshape(-1, 3, A.shape[1]).copy(), step.reshape(-1, 3).copy()
    axes = step[is_cut] / np.linalg.norm(step[is_cut], axis=1, keepdims=True)
    A[is_cut] -= axes[:, :, None] * np.einsum("ji,jik->jk", axes, A[is_cut])[:, None]
    step[is_cut] = 0.0
    return A.reshape(step.size, -1), step.ravel()


def _numbers(rule: str, increments: FloatArray) -> FloatArray:
    """Return the numbers of which a rule makes rotations, (joint, 3)."""
    if rule == "exponential":
        return rotation.logarithm(increments)
    if rule == "first order":
        return np.asarray(2.0 * increments[:, 1:] / increments[:, :1])
    if rule == "axis not unit":
        return _of_long_axes(increments)
    rotations = scipy.spatial.transform.Rotation.from_quat(increments, scalar_first=True)
    angles = rotations.as_euler(rule, suppress_warnings=True)
    return np.asarray(angles[:, [rule.index(axis) for axis in "XYZ"]])


def _of_long_axes(increments: FloatArray) -> FloatArray:
    """Return the vectors w of which (cos |w|/2, sin |w|/2 w) are made, for |w| tan |w|/2."""
    w, lengths = increments[:, 1:], np.linalg.norm(increments[:, 1:], axis=1)
    low, high = np.zeros(len(w)), np.full(len(w), np.pi)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        is_low = middle * np.tan(0.5 * middle) * np.abs(increments[:, 0]) < lengths
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    sign = np.where(increments[:, 0] < 0.0, -1.0, 1.0)
    return np.asarray((sign * low / np.maximum(lengths, 1e-300))[:, None] * w)


def solve(change: Mapping[str, Any], step: Fit) -> Solution:
    """Return the factors in the equation of a program with some formulas changed."""
    model = {**FORMULAS, **change}
    e = np.asarray(_value(model["error"], step.iteration.values))
    values = {"M": step.J @ step.J.T, "p": step.p, "e": e}
    total, *terms = (_value(formula, values) for formula in model["equation"])
    u, gap = _least_squares(np.stack(terms, axis=-1), total)
    return Solution(step, u, max(gap, abs(_value(model["condition"], {"u": u}))))


def iterations(trials: Sequence[PoseTrial], switched: Switches = RIGHT) -> Iterator[Iteration]:
    """Yield the iterations of which the poses before and after are known."""
    solves: dict[str, list[Mapping[str, FloatArray]]] = {}
    for trial in trials:
        inputs, facts, local = trial.case.inputs, trial.case.facts, trial.pose.local
        # Where a sweep ends within a tolerance, different steps may be the same.
        is_telling = trial.is_sweep and "like" not in facts and inputs["tolerance"] == 0.0
        if not is_telling or local is None or not trial.pose.finite:
            continue
        name, path = facts.get("continues", trial.case.name), facts["path"]
        start = np.array(inputs["local_rotations"])
        poses = solves.setdefault(name, [_pose(inputs, path, start, switched)])
        if facts["sweeps"] == len(poses):
            poses.append(_pose(inputs, path, local, switched))
            x = trial.pose.answered_positions
            yield Iteration(name, inputs["target"], tuple(poses), None if x is None else x[path])


def _pose(
    inputs: Mapping[str, Any], path: Any, local: FloatArray, switched: Switches
) -> Mapping[str, FloatArray]:
    x, R = (part[path] for part in forward({**inputs, "local_rotations": local}, switched))
    R, _ = rotation.normalise(R)  # wrong products are not unit
    parents = np.concatenate([rotation.identity(1), R[:-2]])
    return {"x": x, "q": local[path[:-1]], "p": parents, "g": R[:-1]}


def explanations(
    trials: Sequence[PoseTrial],
    greeting: Greeting,
    base: Sequence[SwitchFault] = (),
    is_right: bool = False,
) -> tuple[Explanation, ...]:
    """Return the mistake that explains most iterations, () if none does or they are right.

    The solver's forward kinematics is known to have the faults in `base`. Where all answers are
    right, small steps may be a choice, other formulas are not.
    """
    least, same = LEAST_ANGLE[greeting.precision], SAME[greeting.precision]
    all_iterations = list(iterations(trials, switches(base)))
    steps = [step for step in all_iterations if step.angle >= least]
    cap = _largest([angle for step in steps for angle in step.angles.tolist()], same) * (1.0 - same)
    steps = [step._replace(cap=cap or np.inf) for step in steps]
    steps = [step for step in steps if (step.angles < step.cap).any()] or steps
    keys, values, count = _mistake(steps, same)
    if keys == [UNSOLVED] and all(t.judgement.verdict < Verdict.UNDECIDED for t in trials):
        keys = []  # there are other honest methods
    if is_right and not all("models" in ENTRIES.get(key, ()) for key in keys):
        keys = []
    if len(all_iterations) >= MIN_COUNT and len(steps) < FEW_MOVED * len(all_iterations):
        keys, count = [UNMOVED], max(len(steps), 1)
    if len(steps) >= MIN_COUNT and all(step.is_late for step in steps):
        keys, count = [EARLIER], len(steps)
    if keys == [""] and base:
        keys = [" + ".join(fault.key for fault in base)]
        words = describe("ccd", keys)
    elif any(keys):
        covered = {key for other in keys for key in ENTRIES[other].get("covers", ())}
        keys = [key for key in keys if key not in covered]
        sentences = [Sentence(ENTRIES[key]["sentence"], values) for key in keys]
        words = either(
            [[with_code(ENTRIES[k]["code"], s)] for k, s in zip(keys, sentences, strict=True)]
        )
    else:
        return ()
    return (Explanation(tuple(keys), words, count / max(len(steps), 1), 0.0),)


def _mistake(steps: Sequence[Iteration], same: float) -> tuple[list[str], Mapping[str, float], int]:
    """Return the keys of mistakes, the numbers in their sentences, and the steps they explain."""
    models = [(key, change) for key in ENTRIES for change in ENTRIES[key].get("models", ())]
    of_steps = [model for model in models if OF_STEPS & model[1].keys()]
    of_jacobian = [model for model in models if model not in of_steps]
    keys, fits = _best(fit, [*HONEST, *of_jacobian], steps, same)
    solutions = list[Solution]()
    if keys == [""]:
        keys, solutions = _best(solve, [*HONEST_STEPS, *of_steps], fits, same)
        keys = keys or [UNSOLVED]
    for key, numbers in NUMBERS.items() if keys == [""] else ():
        values = numbers(solutions, same)
        if values is not None:
            return [key], values, len(fits)
    return keys[:MAX_ALTERNATIVES], {}, len(fits)


def _best(
    evaluate: Callable[[Mapping[str, Any], Any], Any],
    models: Sequence[Model],
    items: Sequence[Any],
    same: float,
) -> tuple[list[str], list[Any]]:
    """Return the models that explain most items, an honest model alone, and its results."""
    best, best_results = list[str](), list[Any]()
    for key, change in models:
        results = list[Any]()
        for i, item in enumerate(items):
            if i == TRIAL and not results:
                break
            result = evaluate(change, item)
            results += [result] if result.gap <= same else []
        if len(results) > len(best_results):
            best, best_results = [key], results
        elif len(results) == len(best_results) and key not in ("", *best) and best != [""]:
            best.append(key)
    is_enough = len(best_results) >= max(MIN_COUNT, MIN_SHARE * len(items))
    return (best, best_results) if is_enough else ([], [])


# The numbers in a mistake's sentence that right steps show, None if they do not show the mistake.
Values = Mapping[str, float] | None


def _largest(numbers: Sequence[float], same: float) -> float:
    """Return the largest of some numbers if it is there several times, as a bound is, or 0."""
    maximum = max(numbers, default=0.0)
    count = sum(number >= maximum * (1.0 - same) for number in numbers)
    return maximum if count >= MIN_COUNT else 0.0


def _away(solutions: Sequence[Solution], same: float) -> Values:
    return {} if all(s.step.p @ s.error < 0.0 for s in solutions) else None


def _factor(solutions: Sequence[Solution], same: float) -> Values:
    scale = _largest([float(s.factors[0]) for s in solutions if not s.is_along], same)
    return {"factor": scale} if scale > 1.0 + same else None


def _lengthened(solutions: Sequence[Solution], same: float) -> Values:
    """Return by how much short errors are drawn out to a length in metres or over the reach."""
    long = [s for s in solutions if not s.is_along and s.factors[0] > 1.0 + same]
    links = [np.diff(s.step.iteration.pose(-2)["x"], axis=0) for s in long]
    errors = np.array([s.factors[0] * np.linalg.norm(s.error) for s in long])
    reaches = np.array([np.linalg.norm(link, axis=1).sum() for link in links])
    is_bound = any(_largest(lengths.tolist(), same) for lengths in (errors, errors / reaches))
    return {"factor": float(max(s.factors[0] for s in long))} if is_bound else None


def _small_bound(solutions: Sequence[Solution], same: float) -> Values:
    """Return the bound of all rotations, if it is small."""
    angle = _largest([s.step.iteration.angle for s in solutions], same)
    is_small = 0.0 < angle < SMALL_BOUND
    return {"angle": angle, "degrees": float(np.degrees(angle))} if is_small else None


def _rising(solutions: Sequence[Solution], same: float) -> Values:
    """Return the factor of a damping that grows after each iteration that was a success."""
    ratios = [
        float(after.factors[1] / before.factors[1])
        for before, after in pairwise(s for s in solutions if not s.is_along)
        if before.step.iteration.solve == after.step.iteration.solve
        and len(before.step.iteration.poses) == len(after.step.iteration.poses) - 1
        and before.step.iteration.approach > 0.0
    ]
    is_rising = len(ratios) >= MIN_COUNT and min(ratios) > 1.0 + same
    return {"factor": float(np.median(ratios))} if is_rising else None


NUMBERS: Mapping[str, Callable[[Sequence[Solution], float], Values]] = {
    "steps away from the target": _away,
    "steps too long": _factor,
    "error lengthened": _lengthened,
    "rotations bounded": _small_bound,
    "damping rises": _rising,
}
