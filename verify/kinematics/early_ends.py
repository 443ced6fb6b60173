"""The test by which solves end too early: a quantity that is small at their ends, not before.

The textbook's sweeps are followed up to the pose of each answer, which shows after how many it has
ended.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..explain import ending_test
from ..greeting import Greeting
from ..judgement import Explanation
from .faults import sentences_of
from .predictions import solve
from .sweeps import PoseTrial

KEY, SQUARED = "early by another test", "tolerance against the squared distance"
EARLY_ENDS = {KEY, SQUARED}
# So many solves end early, at least, if squared distances end them.
LEAST_EARLY = 3
# A pose belongs to a sweep within this share of the skeleton's size, by precision. It also belongs
# to a sweep if all others are so many times as far: sweeps enlarge rounding.
SAME_POSE, NEARER = {"double": 1e-7, "single": 1e-5}, 30.0


class FollowedSolve(NamedTuple):
    """The textbook's sweeps up to the end of a solve."""

    distances: FloatArray  # of effector and target, before the first sweep and after each [m]
    tolerance: float  # [m]
    is_early: bool  # whether the textbook goes on

    @property
    def gains(self) -> FloatArray:
        """By how much each sweep lowers the distance [m], infinite before the first."""
        return np.append(np.inf, -np.diff(self.distances))


# What programs compare with a constant or with the tolerance, the constant if the words of the test
# do not tell it, and these words.
Quantity = Callable[[FollowedSolve], FloatArray]
TESTS: Sequence[tuple[Quantity, float | None, Sentence]] = (
    (
        lambda s: -np.arange(len(s.distances), dtype=float),
        None,
        sentence("the number of sweeps is {sweeps}, whatever max_iterations is"),
    ),
    (
        lambda s: s.distances**2 / s.tolerance,
        1.0,
        sentence("the square of the distance to the target is below the tolerance"),
    ),
    (
        lambda s: s.distances,
        None,
        sentence("the distance to the target is below about {bound:.3g} m"),
    ),
    (
        lambda s: s.distances / s.tolerance,
        None,
        sentence("the distance to the target is below about {bound:.3g} times the tolerance"),
    ),
    (
        lambda s: s.gains,
        None,
        sentence("a sweep lowers the distance by less than about {bound:.3g} m"),
    ),
    (
        lambda s: s.gains / s.tolerance,
        None,
        sentence("a sweep lowers the distance by less than about {bound:.3g} times the tolerance"),
    ),
)


def explanation(
    trials: Sequence[PoseTrial], wrong: Sequence[PoseTrial], method: str, greeting: Greeting
) -> Explanation | None:
    """Return the test that ends all wrong solves of a method too early, None if no test does."""
    solves = {
        trial.case.name: _solve(trial, method, greeting)
        for trial in trials
        if trial in wrong or trial.case.facts["least"] == 0.0  # beyond reach solvers may give up
    }
    ended = [solve for solve in solves.values() if solve is not None]
    if not all((s := solves[trial.case.name]) is not None and s.is_early for trial in wrong):
        return None
    if not ended:
        return None
    early = [solve for solve in ended if solve.is_early]
    test = ending_test(TESTS, ended, [solve.is_early for solve in ended])
    is_count = test is not None and test.template == TESTS[0][2].template
    if test is None or (is_count and greeting.fixed.max_iterations is not None):
        return None  # a solver with its own number of sweeps ends by no test
    words = sentence(
        "{fault} {count} of {total} solves end as soon as {test}, and none goes on after that.",
        fault=sentences_of("stop")[KEY],
        count=len(early), total=len(ended), test=test,
    )  # fmt: skip
    return Explanation((KEY,), words, 1.0, 0.0)


def _solve(trial: PoseTrial, method: str, greeting: Greeting) -> FollowedSolve | None:
    """Return the sweeps of a solve, None if its pose is that after no sweep, or after several."""
    inputs, size = trial.case.inputs, trial.case.facts["size"]
    needed = solve(method, inputs)[2]
    poses = [
        solve(method, {**inputs, "tolerance": 0.0, "max_iterations": count})[1]
        for count in range(needed + 1)
    ]
    distances = np.array([trial.pose.distance_to(x) for x in poses])
    count = int(np.argmin(distances))
    others = np.delete(distances, count)
    bound = max(SAME_POSE[greeting.precision] * size, others.min(initial=np.inf) / NEARER)
    if np.flatnonzero(distances <= bound).tolist() != [count]:
        return None
    ends = np.array([x[inputs["effector"]] for x in poses[: count + 1]])
    gaps = np.linalg.norm(ends - inputs["target"], axis=1)
    return FollowedSolve(gaps, float(inputs["tolerance"]), count < needed)


def by_squares(trials: Sequence[PoseTrial]) -> tuple[Explanation, ...]:
    """Return that squared distances end solves, if these end early and no other distance does."""
    solves = [
        (trial.pose.distance, trial.case.inputs, trial.outputs["iterations"])
        for trial in trials
        if "iterations" in trial.outputs
        and not trial.is_sweep
        and trial.case.requirement == "must"
        and trial.case.facts["least"] == 0.0
        and trial.case.facts["before"] ** 2 > trial.case.inputs["tolerance"]
    ]
    early = [
        (inputs, count)
        for distance, inputs, count in solves
        if distance > 1.01 * inputs["tolerance"]
    ]
    ends_so = all(distance**2 <= inputs["tolerance"] for distance, inputs, _ in solves)
    if len(early) < LEAST_EARLY or not ends_so:
        return ()
    if any(count >= inputs["max_iterations"] for inputs, count in early):
        return ()
    return (Explanation((SQUARED,), sentences_of("stop")[SQUARED], 1.0, 0.0),)
