"""Comparisons of our kinematics of skeletons with an engine's."""

import functools

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.inverse_kinematics import IK_SOLVERS, solve_ik
from plumbob.reference.kinematics import forward_kinematics, local_from_global
from plumbob.reference.skeleton import Pose, Skeleton

from . import samples
from .engines import SKELETON_ENGINES, forward_kinematics_by
from .verdict import Comparison

# Poses of each skeleton.
POSES = 4


def joint_positions(engine: str, case: int) -> Comparison:
    """Compare all joints' global positions, relative to the reach."""
    skeleton, local = _skeleton_and_rotations(case)
    return Comparison(
        forward_kinematics(skeleton, local).positions,
        _engine_pose(engine, case).positions,
        baseline=forward_kinematics(skeleton, rotation.identity(*local.shape[:-1])).positions,
        scale=full_reach(skeleton),
    )


def joint_rotations(engine: str, case: int) -> Comparison:
    """Compare all joints' global rotations, as quaternions."""
    pose = forward_kinematics(*_skeleton_and_rotations(case))
    return _compare_rotations(pose.rotations, _engine_pose(engine, case).rotations)


def back_to_local(engine: str, case: int) -> Comparison:
    """Compare the local rotations derived from an engine's global rotations with its input."""
    skeleton, local = _skeleton_and_rotations(case)
    derived = local_from_global(skeleton, _engine_pose(engine, case).rotations)
    return _compare_rotations(derived, local)


def ik_answers(engine: str, case: int) -> Comparison:
    """Compare the joints' positions and the residual of IK solutions, alternating the solvers."""
    problem, solver = divmod(case, len(IK_SOLVERS))
    skeleton, start, effector, target = samples.reach(problem)
    reach, names = full_reach(skeleton), tuple(IK_SOLVERS)
    solution = solve_ik(
        skeleton, start, target, names[solver], effector, tolerance=1e-6 * reach, max_iterations=50
    )
    kinematics = SKELETON_ENGINES[engine](skeleton)
    expected = forward_kinematics_by(kinematics, solution.local_rotations).positions
    initial = forward_kinematics(skeleton, start).positions
    return Comparison(
        np.append(solution.positions, solution.residual),
        np.append(expected, np.linalg.norm(expected[effector] - target)),
        baseline=np.append(initial, np.linalg.norm(initial[effector] - target)),
        scale=reach,
    )


def full_reach(skeleton: Skeleton) -> float:
    """Return the largest possible distance of any joint from the root [m]."""
    distances = np.zeros(skeleton.joint_count)
    for joint in range(1, skeleton.joint_count):
        distances[joint] = distances[skeleton.parents[joint]] + skeleton.link_lengths[joint]
    return float(distances.max())


def _skeleton_and_rotations(case: int) -> tuple[Skeleton, FloatArray]:
    skeleton = samples.skeleton(case)
    return skeleton, samples.local_rotations(case, skeleton, POSES)


@functools.cache
def _engine_pose(engine: str, case: int) -> Pose:
    """Return the engine's poses of a case, cached for other claims."""
    skeleton, local = _skeleton_and_rotations(case)
    return forward_kinematics_by(SKELETON_ENGINES[engine](skeleton), local)


def _compare_rotations(actual: FloatArray, expected: FloatArray) -> Comparison:
    identity = rotation.identity(*actual.shape[:-1])
    return Comparison(actual, _aligned(expected, actual), _aligned(identity, actual), scale=1.0)


def _aligned(q: FloatArray, nearby: FloatArray) -> FloatArray:
    """Return q or -q, the same rotation, whichever is closer to the other quaternion."""
    return np.where(np.sum(q * nearby, axis=-1, keepdims=True) < 0.0, -q, q)
