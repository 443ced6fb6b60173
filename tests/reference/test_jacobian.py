import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference import forward_kinematics, local_from_global, rotation, solve_ik
from reference.inverse_kinematics.chain import new_chain, pose_chain
from reference.inverse_kinematics.jacobian import solve_damped, task_matrix, times, turn_joints

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


def turned(skeleton, local, joint, turn):
    """Return the effector's position after a joint and all below it turn in the world."""
    rotations = np.array(forward_kinematics(skeleton, local).rotations)
    below = [k for k in range(skeleton.joint_count) if joint in skeleton.path(k)]
    rotations[below] = rotation.multiply(rotation.exponential(turn), rotations[below])
    return forward_kinematics(skeleton, local_from_global(skeleton, rotations)).positions[-1]


def jacobian(skeleton, local):
    """Return the effector's derivative by all joints' turns, by differences, (3, 3 joint)."""
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


def test_joints_turn_along_the_transposed_jacobian(skeleton, local, chain, rng):
    z = rng.standard_normal(3)
    before = chain.positions[-1].copy()
    turn_joints(chain, tuple(STEP * z))
    moved = (chain.positions[-1] - before) / STEP
    J = jacobian(skeleton, local)
    np.testing.assert_allclose(moved, J @ (J.T @ z), atol=10 * DIFFERENCE)


entries = st.floats(-1.0, 1.0)


@given(st.lists(entries, min_size=6, max_size=6), st.lists(entries, min_size=3, max_size=3))
def test_damped_equations_are_solved(factor, b):
    F = np.array([[factor[0], 0, 0], [factor[1], factor[2], 0], factor[3:]])
    S = F @ F.T
    A = (S[0, 0], S[1, 1], S[2, 2], S[0, 1], S[0, 2], S[1, 2])
    np.testing.assert_allclose(times(A, b), S @ b, atol=1e-14)
    z = solve_damped(A, 0.01, b)
    # The condition number is at most a thousand, times rounding.
    np.testing.assert_allclose((S + 0.01 * np.eye(3)) @ z, b, atol=1e-12)


def test_levenberg_marquardt_converges_quadratically(skeleton, local, rng, speed):
    target = forward_kinematics(skeleton, rotation.random(rng, 6)).positions[-1]
    history = solve_ik(
        skeleton, local, target, "levenberg_marquardt", tolerance=1e-12, record=True
    ).history
    first, second = history[-3:-1] / skeleton.reach()
    assert second < first**1.6 < 1e-3  # the square, but for a constant
    assert len(history) < 25
