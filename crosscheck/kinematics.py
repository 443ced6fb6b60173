"""Skeletons: our kinematics beside an engine's, case by case."""

import functools
import itertools
from collections.abc import Iterator

import numpy as np

from reference import rotation
from reference.arguments import FloatArray
from reference.inverse_kinematics import IK_SOLVERS, solve_ik
from reference.kinematics import forward_kinematics, local_from_global
from reference.skeleton import Pose, Skeleton

from . import samples
from .engines import SKELETON_ENGINES, forward_kinematics_by
from .verdict import Comparison

# Poses of each skeleton.
POSES = 4


def joint_positions(engine: str, cases: int) -> Iterator[Comparison]:
    """Compare all joints' global positions, over the reach."""
    for case in range(cases):
        skeleton, local = _posed(case)
        yield Comparison(
            ours=forward_kinematics(skeleton, local).positions,
            theirs=_engine_pose(engine, case).positions,
            still=forward_kinematics(skeleton, rotation.identity(*local.shape[:-1])).positions,
            scale=full_reach(skeleton),
        )


def joint_rotations(engine: str, cases: int) -> Iterator[Comparison]:
    """Compare all joints' global rotations, as quaternions."""
    for case in range(cases):
        ours = forward_kinematics(*_posed(case)).rotations
        yield _rotations(ours, _engine_pose(engine, case).rotations)


def back_to_local(engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the local rotations we find in an engine's global ones with those it was given."""
    for case in range(cases):
        skeleton, local = _posed(case)
        ours = local_from_global(skeleton, _engine_pose(engine, case).rotations)
        yield _rotations(ours, local)


def ik_answers(engine: str, cases: int) -> Iterator[Comparison]:
    """Compare the joints' positions and the residual of IK answers, by each solver in turn."""
    problems = ((problem, solver) for problem in itertools.count() for solver in IK_SOLVERS)
    for problem, solver in itertools.islice(problems, cases):
        skeleton, start, effector, target = samples.reach(problem)
        reach = full_reach(skeleton)
        solution = solve_ik(
            skeleton, start, target, solver, effector, tolerance=1e-6 * reach, max_iterations=50
        )
        theirs = _by(engine, skeleton, solution.local_rotations).positions
        still = forward_kinematics(skeleton, start).positions
        yield Comparison(
            ours=np.append(solution.positions, solution.residual),
            theirs=np.append(theirs, np.linalg.norm(theirs[effector] - target)),
            still=np.append(still, np.linalg.norm(still[effector] - target)),
            scale=reach,
        )


def full_reach(skeleton: Skeleton) -> float:
    """Return the greatest distance any joint can have from the root [m]."""
    distances = np.zeros(skeleton.joint_count)
    for j in range(1, skeleton.joint_count):
        distances[j] = distances[skeleton.parents[j]] + skeleton.link_lengths[j]
    return float(distances.max())


def _posed(case: int) -> tuple[Skeleton, FloatArray]:
    skeleton = samples.skeleton(case)
    return skeleton, samples.local_rotations(case, skeleton, POSES)


@functools.cache
def _engine_pose(engine: str, case: int) -> Pose:
    """Return the engine's poses of a case, kept for the claims that follow."""
    return _by(engine, *_posed(case))


def _by(engine: str, skeleton: Skeleton, local: FloatArray) -> Pose:
    return forward_kinematics_by(SKELETON_ENGINES[engine](skeleton), local)


def _rotations(ours: FloatArray, theirs: FloatArray) -> Comparison:
    still = rotation.identity(*ours.shape[:-1])
    return Comparison(ours, _same_sign(theirs, ours), _same_sign(still, ours), scale=1.0)


def _same_sign(q: FloatArray, other: FloatArray) -> FloatArray:
    """Return q or -q, which is the same rotation, whichever is nearer to the other."""
    return np.where(np.sum(q * other, axis=-1, keepdims=True) < 0.0, -q, q)
