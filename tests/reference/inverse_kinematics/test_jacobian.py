import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import forward_kinematics, local_from_global, rotation, scenes, solve_ik
from plumbob.reference.inverse_kinematics.chain import new_chain, pose_chain
from plumbob.reference.inverse_kinematics.jacobian_methods import (
    linearise,
    rotate_joints,
    solve_damped,
    task_matrix,
    times,
)

# A forward difference over 1e-7 rad is off by about that much, and rounding by 1e-9 of the reach.
STEP, DIFFERENCE = 1e-7, 1e-6


@pytest.fixture
def chain(skeleton, local):
    path = skeleton.path()
    chain = new_chain(skeleton.offsets, path)
    pose_chain(chain, path, local)
    return chain


def matrix(A):
    """Return the symmetric matrix of six entries xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = A
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def turned(skeleton, local, joint, rotation_vector):
    """Return the effector's position after a joint and all below it rotate in the world."""
    rotations = np.array(forward_kinematics(skeleton, local).rotations)
    below = [k for k in range(skeleton.joint_count) if joint in skeleton.path(k)]
    rotations[below] = rotation.multiply(rotation.exponential(rotation_vector), rotations[below])
    return forward_kinematics(skeleton, local_from_global(skeleton, rotations)).positions[-1]


def jacobian(skeleton, local):
    """Return the effector's derivative by all joints' rotations, by differences, (3, 3 joint)."""
    at = forward_kinematics(skeleton, local).positions[-1]
    columns = [
        (turned(skeleton, local, joint, STEP * axis) - at) / STEP
        for joint in skeleton.path()[:-1]
        for axis in np.eye(3)
    ]
    return np.stack(columns, axis=-1)


def test_the_task_matrix_is_the_jacobian_times_its_transpose(skeleton, local, chain):
    J = jacobian(skeleton, local)
    np.testing.assert_allclose(matrix(task_matrix(chain)), J @ J.T, atol=DIFFERENCE)
    assert np.abs(J @ J.T).max() > 0.1


def test_joints_rotate_along_the_transposed_jacobian(skeleton, local, chain, rng):
    z = rng.standard_normal(3)
    before = chain.positions[-1].copy()
    rotate_joints(chain, tuple(STEP * z))
    moved = (chain.positions[-1] - before) / STEP
    J = jacobian(skeleton, local)
    np.testing.assert_allclose(moved, J @ (J.T @ z), atol=10 * DIFFERENCE)


entries = st.floats(-1.0, 1.0)


@given(st.lists(entries, min_size=6, max_size=6), st.lists(entries, min_size=3, max_size=3))
def test_damped_equations_are_solved(factor, b):
    F = np.array([[factor[0], 0, 0], [factor[1], factor[2], 0], factor[3:]])
    S = F @ F.T
    A = (S[0, 0], S[1, 1], S[2, 2], S[0, 1], S[0, 2], S[1, 2])
    np.testing.assert_allclose(times(A, b), S @ b, rtol=0, atol=1e-14)
    z = solve_damped(A, 0.01, b)
    # The condition number is at most a thousand, times rounding.
    np.testing.assert_allclose((S + 0.01 * np.eye(3)) @ z, b, rtol=0, atol=1e-12)


STEPS = {
    "levenberg_marquardt": lambda A, e, reach: np.linalg.solve(A + 0.5 * e @ e * np.eye(3), e),
    "damped_least_squares": lambda A, e, reach: np.linalg.solve(A + 0.01 * reach**2 * np.eye(3), e),
    "jacobian_transpose": lambda A, e, reach: (e @ A @ e) / (e @ A @ A @ e) * e,
}


@pytest.mark.parametrize("solver", STEPS)
def test_one_iteration_is_the_textbook_s(skeleton, local, solver, rng, backend):
    """J is dense here, by the arms; a joint rotates by its part of J^T z, seen from its parent."""
    pose, path = forward_kinematics(skeleton, local), skeleton.path()
    target = forward_kinematics(skeleton, rotation.random(rng, 6)).positions[-1]
    arms = pose.positions[-1] - pose.positions[path[:-1]]
    J = np.concatenate([np.cross(np.eye(3), arm) for arm in arms]).T
    rotations = J.T @ STEPS[solver](J @ J.T, target - pose.positions[-1], skeleton.reach())
    expected = local.copy()
    for joint, rotation_vector in zip(path[:-1], rotations.reshape(-1, 3), strict=True):
        parent = skeleton.parents[joint]
        above = pose.rotations[parent] if parent >= 0 else rotation.identity()
        in_parent = rotation.rotate(rotation.conjugate(above), rotation_vector)
        expected[joint] = rotation.multiply(rotation.exponential(in_parent), local[joint])
    solution = solve_ik(skeleton, local, target, solver, tolerance=0.0, max_iterations=1)
    cosines = np.abs(np.vecdot(solution.local_rotations, expected))
    np.testing.assert_allclose(cosines, np.ones(6), rtol=0, atol=1e-13)


def test_a_chain_that_had_to_be_bent_is_linearised_where_it_then_is():
    arm, rest = scenes.lab_arm()
    chain = new_chain(arm.offsets, arm.path())
    pose_chain(chain, arm.path(), rest)
    target = (0.0, 0.3, 0.0)
    e, A = linearise(chain, target, 0.0)
    assert np.ptp(chain.positions[:, [0, 2]]) > 0.1
    np.testing.assert_array_equal(e, target - chain.positions[-1])
    assert task_matrix(chain) == A


def test_levenberg_marquardt_converges_quadratically(skeleton, local, rng, backend):
    target = forward_kinematics(skeleton, rotation.random(rng, 6)).positions[-1]
    history = solve_ik(
        skeleton, local, target, "levenberg_marquardt", tolerance=1e-12, record=True
    ).history
    first, second = history[-3:-1] / skeleton.reach()
    assert second < first**1.6 < 1e-3  # the square, but for a constant
    assert len(history) < 25
