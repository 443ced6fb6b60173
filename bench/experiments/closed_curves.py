"""Tracking of closed curves: how far joints rotate between frames, and drift over repetitions.

The frames are solved from rest, from the last solution, or as the nearest of several solutions.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import IK_SOLVERS, IKSolution, Outcome, Skeleton, rotation, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import difference

from ..measure import metrics
from ..measure.block import SCALES, Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Floats1
from ..problems.curves import (
    CURVE,
    DRIFT_FRAMES,
    FollowedCurve,
    arm_closed_curves,
    heart_three_times,
    robot_closed_curves,
)
from .arm import LIMITS, FollowedMotion, followed, solve_frames
from .chain import SolveFacts

SUITE = "tracking"
# The task of records on a curve followed three times, beside `CURVE`.
DRIFT = "drift"
# The modes in which the frames of a curve are solved.
COLD, WARM, NEAREST = "cold", "warm", "nearest"
# The starts of a frame, of which the nearest solution is taken: as many as an arm with a wrist has
# solutions. The seed of random starts.
STARTS, _SEED = 8, 2014
# A quick run on a robot has this solver only: the others take long to compile.
ROBOT_SOLVER = "levenberg_marquardt"


class DriftAngles(SolveFacts, frozen=True):
    """The largest angle of a joint from its first pose after each repetition [rad]."""

    drift: Floats1
    residual: Floats1


KINDS = {CURVE: FollowedMotion, DRIFT: DriftAngles}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver in each mode, and the heart three times."""
    is_quick = scale.seconds == SCALES["quick"].seconds
    robot_solvers = [ROBOT_SOLVER] if is_quick else list(IK_SOLVERS)
    pairs = [(curve, solver) for curve in arm_closed_curves() for solver in IK_SOLVERS]
    pairs += [(curve, solver) for curve in robot_closed_curves() for solver in robot_solvers]
    for curve, solver in pairs:
        for mode in MODES:
            measure = partial(follow_closed, curve, solver, mode)
            yield _block(curve, solver, mode, measure, CURVE)
    heart = heart_three_times()
    for solver in IK_SOLVERS:
        for mode in (WARM, NEAREST):
            yield _block(heart, solver, mode, partial(drift, heart, solver, mode), DRIFT)


def _block(
    problem: FollowedCurve, solver: str, mode: str, measure: partial[Measured], task: str
) -> Block:
    settings, facts = {"mode": mode, **LIMITS._asdict()}, {"task": task, "title": problem.title}
    return Block(SUITE, problem.name, solver, measure, settings, facts=facts)


def follow_closed(problem: FollowedCurve, solver: str, mode: str) -> Measured:
    """Follow the curve once; the last angle leads from the last frame back to the first."""
    return followed(problem, MODES[mode](problem, solver), closed=True)


def solve_nearest(problem: FollowedCurve, solver: str) -> IKSolution:
    """Return in each frame the solution nearest to the previous frame, of several starts.

    The starts are the previous solution, the start pose and random poses, the same in all frames.
    Where no start reaches the target, the solve from the previous solution counts. The iterations
    are the sum over all starts.
    """
    model, q, frames = problem.model, problem.start, []
    random_poses = _random_poses(problem)
    for target in problem.curve:
        starts = np.stack([q, problem.start, *random_poses])
        limits = LIMITS._asdict()
        solutions: Any = solve_ik(model, starts, target, solver, restarts=0, phases=1, **limits)
        distances = np.linalg.norm(difference(model, solutions.coordinates, q), axis=-1)
        nearest = np.where(solutions.outcome == Outcome.CONVERGED, distances, np.inf).argmin()
        frame = IKSolution(*(values[nearest : nearest + 1] for values in solutions))
        frames.append(frame._replace(iterations=solutions.iterations.sum(keepdims=True)))
        q = frame.coordinates[0]
    return IKSolution(*map(np.concatenate, zip(*frames, strict=True)))


def _random_poses(problem: FollowedCurve) -> FloatArray:
    """Return random poses; the last joint does not move the effector and stays as in the start."""
    model, rng = problem.model, np.random.default_rng(_SEED)
    if isinstance(model, Skeleton):
        poses = rotation.random(rng, STARTS - 2, model.joint_count)
    else:
        poses = model.random(rng, STARTS - 2)
    poses[:, -1] = problem.start[-1]
    return poses


def drift(problem: FollowedCurve, solver: str, mode: str) -> Measured:
    """Follow the curve three times over; return the angles from the first pose after each."""
    problem = replace(problem, curve=np.append(problem.curve, problem.curve[:1], axis=0))
    motion = MODES[mode](problem, solver)
    frames = DRIFT_FRAMES * np.arange(1, 4)
    angles = rotation.angle(motion.local_rotations[[0, 0, 0]], motion.local_rotations[frames])
    return {"drift": angles.max(axis=-1), "residual": np.asarray(motion.residual)}


# The ways in which the frames of a curve are solved.
MODES: dict[str, Callable[[FollowedCurve, str], IKSolution]] = {
    COLD: partial(solve_frames, options={"warm": False}),
    WARM: partial(solve_frames, options={}),
    NEAREST: solve_nearest,
}


# What is shown.

from ..figures.chart import SPAN, Panel, declared_chart, series
from ..figures.sketch import Sketch
from ..tables.captions import Captions
from ..tables.columns import folded, spread_of, text, words_in
from ..tables.results import Results, by_problem, grouped, label
from ..tables.table import Cell, Column, Summary, in_unit, words
from .chain import share_within_tolerance

# Rotations within this share of each other are equally large.
ALIKE = 0.01
_CAPTIONS = Captions(__file__)


class ClosedCurve(NamedTuple):
    """A curve followed by a solver: its records by mode, and those of its repetitions."""

    by_mode: dict[str, Record]
    drifts: dict[str, Record]


def _curves(results: Results) -> list[ClosedCurve]:
    """Return each curve followed by a solver in all modes."""
    curves, drifts = (_by_mode(results, task) for task in (CURVE, DRIFT))
    return [
        ClosedCurve(by_mode, drifts.get((problem.replace("arm/", "drift/"), solver), {}))
        for (problem, solver), by_mode in curves.items()
        if by_mode.keys() >= MODES.keys()
    ]


def _by_mode(results: Results, task: str) -> dict[tuple[str, str], dict[str, Record]]:
    groups = grouped(results.all(SUITE, task=task), lambda r: (r.problem, r.solver))
    return {key: {r.values.mode: r for r in records} for key, records in groups.items()}


def _largest_rotation(record: Record) -> float:
    return metrics.spread(record.values.largest_angle[:-1]).largest


def _in_modes(
    title: str, modes: Iterable[str], read: Callable[[Record], Cell], unit: str = "", best: str = ""
) -> Iterator[Column]:
    """Yield the columns of a quantity, which is read from the record of a mode."""

    def cell(mode: str, curve: ClosedCurve) -> Cell:
        return read(curve.by_mode[mode])

    for mode in modes:
        yield Column(f"{title}, {mode}", unit, read=partial(cell, mode), best=best, group=title)


def _drifts(mode: str) -> Iterator[Column]:
    """Yield the columns of the angles from the first pose after each repetition."""

    def cell(i: int, curve: ClosedCurve) -> float | None:
        return float(curve.drifts[mode].values.drift[i]) if mode in curve.drifts else None

    look = Column(f"drift, {mode}", "°", best="least", group=f"drift, {mode}")
    for i in range(3):
        yield replace(look, title=f"{look.group}, after {i + 1}", read=partial(cell, i))


COLUMNS = (
    text("curve", lambda curve: curve.by_mode[WARM].title),
    text("solver", lambda curve: label(curve.by_mode[WARM].solver)),
    *_in_modes("largest rotation", MODES, _largest_rotation, "°", "least"),
    *_in_modes(
        "closing rotation", [WARM, NEAREST], lambda r: r.values.largest_angle[-1], "°", "least"
    ),
    *_in_modes("mean iterations", [WARM, NEAREST], lambda r: metrics.mean(r.values.iterations)),
    *folded(
        *_in_modes("mean iterations", [COLD], lambda r: metrics.mean(r.values.iterations)),
        *_in_modes("within tolerance", MODES, share_within_tolerance, best="greatest"),
        *_in_modes("largest path error", MODES, lambda r: spread_of(r, "residual")[2], "m"),
        *_in_modes("mean rotation", MODES, lambda r: metrics.mean(r.values.mean_angle[:-1]), "°"),
        *_drifts(WARM),
        *_drifts(NEAREST),
        Column("frames", read=lambda curve: curve.by_mode[WARM].values.residual.size),
    ),
)


def _summary(curves: Sequence[ClosedCurve]) -> Summary:
    warm, nearest = (_count_smaller(curves, *modes) for modes in ((WARM, COLD), (NEAREST, WARM)))
    return Summary(
        "Starting each frame from the previous solution makes the largest rotation of a joint "
        f"smaller in {warm} of {len(curves)} cases; the nearest of several solutions makes the "
        f"rotation smaller still in {nearest}.",
        tuple(_points(curves)),
    )


def _count_smaller(curves: Sequence[ClosedCurve], mode: str, other: str) -> int:
    """Return the number of curves whose largest rotation is smaller in a mode than in another."""
    pairs = ((curve.by_mode[mode], curve.by_mode[other]) for curve in curves)
    return sum((1.0 + ALIKE) * _largest_rotation(a) < _largest_rotation(b) for a, b in pairs)


def _points(curves: Sequence[ClosedCurve]) -> Iterator[str]:
    for mode in MODES:
        records = [curve.by_mode[mode] for curve in curves]
        worst = max(records, key=_largest_rotation)
        angle = words_in(_largest_rotation(worst), "°")
        hits, total = np.sum([share_within_tolerance(record)[:2] for record in records], axis=0)
        frames = f"{words(int(hits))} of {words(int(total))} frames"
        yield f"{mode}: {angle} ({worst.title}, {label(worst.solver)}); {frames}"


def jitter_chart(results: Results) -> Sketch | None:
    """Show the largest rotation of a joint on each curve, from rest and from the last solution."""
    curves = by_problem(results.all("arm", task=CURVE, warm=False))
    warm = {(r.problem, r.solver): r for r in results.all("arm", task=CURVE, warm=True)}
    spans = []
    for row, records in enumerate(curves.values()):
        for record in records:
            motions = filter(None, [record, warm.get((record.problem, record.solver))])
            angles = [in_unit(motion.values.largest_angle.max(), "°") for motion in motions]
            spans.append(series(record.solver, angles, [row] * len(angles), form=SPAN))
    rows = tuple(str(records[0].values.curve) for records in curves.values())
    panels = [Panel("", tuple(spans))] if spans else []
    return declared_chart(_CAPTIONS.figure("jitter"), panels, results.user_solvers, rows=rows)


jitter = _CAPTIONS.layout("q3_jitter", _curves, _summary, columns=COLUMNS, figures=(jitter_chart,))

LAYOUTS = (jitter,)
