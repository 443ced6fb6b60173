"""Following closed curves: frames from rest, from the last solution, and the nearest of several."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import (
    IK_SOLVERS,
    IKSolution,
    Outcome,
    Skeleton,
    rotation,
    solve_ik,
)
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import difference

from ...harness.block import Block, Measured, Scale
from ...problems.curves import (
    DRIFT_FRAMES,
    FollowedCurve,
    arm_closed_curves,
    heart_three_times,
    robot_closed_curves,
)
from ..arm.measurement import LIMITS, followed, solve_frames
from . import COLD, CURVE, DRIFT, NEAREST, WARM

SUITE = "tracking"
# The starts of a frame, of which the nearest solution is taken, and the seed of random starts.
STARTS, _SEED = 8, 2014
# A quick run on a robot has this solver only: the others take long to compile.
ROBOT_SOLVER = "levenberg_marquardt"


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver in each mode, and the heart three times."""
    robot_solvers = [ROBOT_SOLVER] if scale.is_as_short_as("quick") else list(IK_SOLVERS)
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
