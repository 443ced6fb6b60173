import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import forward_kinematics, rotation, scenes, solve_ik
from plumbob.reference.inverse_kinematics.chain import new_chain, pose_chain
from plumbob.reference.inverse_kinematics.jacobian_methods import (
    linearise,
    solve_damped,
    task_matrix,
    times,
)

pytestmark = pytest.mark.both_backends

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


def test_a_chain_that_had_to_be_bent_is_linearised_where_it_then_is():
    arm, rest = scenes.lab_arm()
    chain = new_chain(arm.offsets, arm.path(), 0)
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
