"""The lab's arm: accuracy, iterations and jitter on every curve, and targets beyond its reach."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import IK_SOLVERS, IKSolution, Skeleton, forward_kinematics, rotation, track
from plumbob.reference.arguments import FloatArray

from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.chain_targets import SolverLimits, solve_targets
from ..measure.record import Record
from ..measure.values import Floats1, Integers1
from ..problems.chains import BEYOND
from ..problems.curves import CURVE, FollowedCurve, arm_beyond, arm_curves
from .chain import BEYOND_TOLERANCE, CHAIN, ChainSolves, SolveFacts

LIMITS = SolverLimits(tolerance=1e-4, max_iterations=100)
BEYOND_LIMITS = SolverLimits(BEYOND_TOLERANCE, max_iterations=1000)


class FollowedMotion(SolveFacts, frozen=True):
    """A motion along a curve, (frame,): an outcome is the number of an `Outcome`.

    The angles are the rotations of joints from each frame to the next [rad].
    """

    residual: Floats1
    iterations: Integers1
    outcome: Integers1
    largest_angle: Floats1
    mean_angle: Floats1


KINDS = {CURVE: FollowedMotion, BEYOND: ChainSolves}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver, from rest and from the last solution (warm), then Q1."""
    for curve in arm_curves():
        facts = {"task": CURVE, "title": f"arm, {curve.title}", "curve": curve.title}
        for solver in IK_SOLVERS:
            for warm in (False, True):
                settings = {**LIMITS._asdict(), "warm": warm}
                measure = partial(follow, curve, solver, {"warm": warm})
                yield Block("arm", curve.name, solver, measure, settings, facts=facts)
    beyond, limits = arm_beyond(scale.targets), BEYOND_LIMITS._asdict()
    facts = {"task": BEYOND, "title": beyond.title}
    for solver in IK_SOLVERS:
        measure = partial(solve_targets, beyond, solver, BEYOND_LIMITS)
        yield Block("arm", beyond.name, solver, measure, limits, scale.targets, facts)


def follow(problem: FollowedCurve, solver: str, options: dict[str, Any]) -> Measured:
    """Follow a curve once."""
    return followed(problem, solve_frames(problem, solver, options), closed=False)


def followed(problem: FollowedCurve, motion: IKSolution, closed: bool) -> Measured:
    """Return a motion along a curve; residuals are recomputed by forward kinematics.

    The last angle of a closed curve is from the last frame back to the first.
    """
    pose = forward_kinematics(problem.model, motion.coordinates)
    angles = _joint_angles(problem, motion)[: None if closed else -1]
    return {
        "residual": np.linalg.norm(pose.positions[:, -1] - problem.curve, axis=-1),
        "iterations": np.asarray(motion.iterations),
        "outcome": np.asarray(motion.outcome),
        "largest_angle": angles.max(axis=-1),
        "mean_angle": angles.mean(axis=-1),
    }


def solve_frames(problem: FollowedCurve, solver: str, options: dict[str, Any]) -> IKSolution:
    """Return the solutions of all frames of a curve."""
    limits: dict[str, Any] = {**LIMITS._asdict(), **options}
    return track(problem.model, problem.curve, solver, problem.start, **limits)


def _joint_angles(problem: FollowedCurve, motion: IKSolution) -> FloatArray:
    """Return the angle by which each joint rotates to the following frame [rad], (frame, joint).

    The first frame follows the last. A hinge's angle is not reduced to half a revolution, though
    its link looks the same.
    """
    if isinstance(problem.model, Skeleton):
        # The effector keeps its rotation and would only dilute the mean.
        R = motion.local_rotations[:, :-1]
        return rotation.angle(R, np.roll(R, -1, axis=0))
    return np.abs(np.roll(motion.coordinates, -1, axis=0) - motion.coordinates)


# What is shown.

from ..figures.chart import Panel, Series, declared_chart, series
from ..figures.sketch import Sketch
from ..peers import catalogue
from ..tables.captions import Captions
from ..tables.columns import folded, quantiles, spread_of, spread_of_iterations, text
from ..tables.results import Results, by_problem, grouped, label, leaders
from ..tables.table import INTERVAL, Column, Summary, words
from .chain import (
    ALLOWED,
    PROBLEM,
    REMARK,
    SOLVER,
    histories,
    share_within_tolerance,
    within_tolerance,
)

STARTS = {None: "random", False: "rest", True: "last solution"}
_CAPTIONS = Captions(__file__)
# Which targets are reached, by problem and start.
Hits = dict[tuple[str, str], np.ndarray]


def _within_reach(results: Results) -> list[Record]:
    """Return the records of each solver on targets within reach, problem by problem."""
    records = results.all("arm", task=CURVE, warm=False)
    records += results.all("arm", task=CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.values.stratum != BEYOND]
    return [record for group in by_problem(records).values() for record in group]


def _start(record: Record) -> str:
    return STARTS[record.values.warm]


def _median_time(record: Record) -> float | None:
    seconds = record.measured.get("seconds")
    return None if seconds is None else float(np.median(seconds))


_residual = partial(quantiles, "residual", read=partial(spread_of, name="residual"), unit="m")
COLUMNS = (
    PROBLEM,
    text("start", _start),
    SOLVER,
    Column("within tolerance", note=INTERVAL, best="greatest", read=share_within_tolerance),
    *_residual(["largest"]),
    Column("time, median", "µs", read=_median_time),
    *quantiles("iterations", ["median"], spread_of_iterations),
    ALLOWED,
    REMARK,
    *folded(
        *_residual(["median", "95 %"]),
        *quantiles("iterations", ["95 %", "largest"], spread_of_iterations),
    ),
)


def _summary(records: Sequence[Record]) -> Summary:
    hits: dict[str, Hits] = {
        solver: {(record.problem, _start(record)): within_tolerance(record) for record in members}
        for solver, members in grouped(records, lambda record: label(record.solver)).items()
    }
    rivals = {solver: hits[solver] for solver in hits if not catalogue.is_loop(solver)}
    ranking = _ranking(rivals)
    first = f"Over all problems most targets are solved by {leaders(ranking)}." if ranking else ""
    points = (
        f"{solver}: {words(metrics.share(np.concatenate([*problems.values()])))}"
        for solver, problems in hits.items()
    )
    unranked = "No two solvers were given all problems, so that none is ranked."
    return Summary(first or unranked, tuple(points))


def _ranking(hits: dict[str, Hits]) -> metrics.Ranking | None:
    """Return a ranking of the solvers that solve all problems, None of fewer than two."""
    sizes: dict[tuple[str, str], int] = {}
    for problem, hit in (item for problems in hits.values() for item in problems.items()):
        sizes[problem] = max(hit.size, sizes.get(problem, 0))
    complete = {
        solver: np.concatenate([problems[problem] for problem in sizes])
        for solver, problems in hits.items()
        if {problem: hit.size for problem, hit in problems.items()} == sizes
    }
    return metrics.ranking(complete) if len(complete) > 1 else None


def residuals_chart(results: Results) -> Sketch | None:
    """Show the residual against the iteration, median and 10 to 90 % of the targets."""
    panels = (
        Panel(group[0].title, tuple(map(_residuals, group)), group[0].values.tolerance)
        for group in histories(results)
    )
    return declared_chart(_CAPTIONS.figure("ik_residuals"), panels, results.user_solvers)


def _residuals(record: Record) -> Series:
    """Return the residuals after each iteration; a logarithmic axis has no iteration 0."""
    solves = record.values
    median, low, high = solves.history_median, solves.history_low, solves.history_high
    return series(record.solver, np.arange(1, len(median)), median[1:], (low[1:], high[1:]))


accuracy = _CAPTIONS.layout(
    "accuracy", _within_reach, _summary, columns=COLUMNS, figures=(residuals_chart,), compared=2
)

LAYOUTS = (accuracy,)
