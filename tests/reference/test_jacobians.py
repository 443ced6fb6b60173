"""Jacobians are derivatives by the steps that `integrate` takes, and `difference` undoes those."""

import numpy as np
import pytest
from drawn_trees import TREES, drawn
from hypothesis import given

from plumbob.reference import Articulation, Mimic, Skeleton, forward_kinematics, rotation
from plumbob.reference.articulation import KINDS
from plumbob.reference.jacobians import difference, integrate, jacobian, jacobians

pytestmark = pytest.mark.both_backends

# Central differences over a step of 1e-5 are off by 1e-10 of a few metres, and rounding by 1e-11.
STEP, DIFFERENCE = 1e-5, 1e-8
ROUNDING = 1e-13

at_both_speeds = drawn()


def by_differences(model, q):
    """Return all joints' Jacobians by central differences, (joint, 6, freedom)."""
    at = forward_kinematics(model, q)
    columns = [np.empty((model.joint_count, 6, 0))]
    for step in STEP * np.eye(model.freedom_count):
        ends = [forward_kinematics(model, integrate(model, q, v)) for v in (step, -step)]
        moved = ends[0].positions - ends[1].positions
        rotations = [
            rotation.multiply(end.rotations, rotation.conjugate(at.rotations)) for end in ends
        ]
        turned = rotation.logarithm(rotations[0]) - rotation.logarithm(rotations[1])
        columns.append(np.concatenate([moved, turned], axis=1)[..., None] / (2 * STEP))
    return np.concatenate(columns, axis=-1)


@pytest.fixture
def arm(articulated):
    """Return joints of all kinds, two of them mimics."""
    model = articulated([*KINDS, "slide", "hinge"], 7)
    return Articulation(
        model.skeleton, model.kinds, model.axes, frames=model.frames,
        mimics={5: Mimic(2, -0.5, 0.3), 6: Mimic(1, 2.0, 0.1)},
    )  # fmt: skip


@pytest.fixture
def q(arm, rng):
    return arm.random(rng)


@at_both_speeds
@given(**TREES)
def test_jacobians_are_derivatives_along_steps(articulated, backend, kinds, seed):
    model = articulated(kinds, seed)
    q = model.random(np.random.default_rng(seed))
    J = jacobians(model, q)
    assert J.shape == (model.joint_count, 6, model.freedom_count)
    np.testing.assert_allclose(J, by_differences(model, q), rtol=0, atol=DIFFERENCE)
    if model.freedom_count:
        assert np.abs(J).max() > 0.1


@at_both_speeds
@given(**TREES)
def test_difference_undoes_a_step(articulated, backend, kinds, seed):
    model = articulated(kinds, seed)
    rng = np.random.default_rng(seed)
    q, v = model.random(rng), rng.uniform(-1.8, 1.8, model.freedom_count)
    np.testing.assert_allclose(difference(model, integrate(model, q, v), q), v, rtol=0, atol=1e-14)


@at_both_speeds
@given(**TREES)
def test_a_step_by_the_difference_arrives(articulated, backend, kinds, seed):
    model = articulated(kinds, seed)
    q0, q1 = model.random(np.random.default_rng(seed), 2)
    arrived = forward_kinematics(model, integrate(model, q0, difference(model, q1, q0)))
    expected = forward_kinematics(model, q1)
    np.testing.assert_allclose(arrived.positions, expected.positions, rtol=0, atol=ROUNDING)
    angles = rotation.angle(arrived.rotations, expected.rotations)
    np.testing.assert_allclose(angles, 0.0, rtol=0, atol=ROUNDING)


def test_steps_rotate_a_ball_in_its_own_frame_and_shift_a_free_joint_in_its_unmoved_one(backend):
    quarter = rotation.exponential([0.0, 0.0, np.pi / 2])
    free = Articulation(Skeleton([-1], np.zeros((1, 3))), "free")
    moved = integrate(free, [1.0, 2.0, 3.0, *quarter], [1.0, 0.0, 0.0, np.pi / 2, 0.0, 0.0])
    about_x = rotation.exponential([np.pi / 2, 0.0, 0.0])
    expected = [2.0, 2.0, 3.0, *rotation.multiply(quarter, about_x)]
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-15)
    # Shifts are along the world's axes; here a rotation about the joint's x is one about y.
    J = jacobian(free, [1.0, 2.0, 3.0, *quarter])
    np.testing.assert_allclose(J[:, 0], [1, 0, 0, 0, 0, 0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(J[:, 3], [0, 0, 0, 0, 1, 0], rtol=0, atol=1e-15)


def test_the_jacobian_of_a_joint_is_its_row_of_all(arm, q, backend):
    everything = jacobians(arm, q)
    for j, name in enumerate(arm.names):
        assert (jacobian(arm, q, name) == everything[j]).all()
        assert (jacobian(arm, q, j) == everything[j]).all()
    assert (jacobian(arm, q, -1) == everything[-1]).all()
    several = [4, 0, 4]
    assert (jacobians(arm, np.array([q, q]), several) == everything[several]).all()
    assert jacobians(arm, q, []).shape == (0, *everything.shape[1:])
    for wrong in ([arm.joint_count], [-1], [0.5], 0):
        with pytest.raises(ValueError, match="joints: expected "):
            jacobians(arm, q, wrong)


def test_leading_axes_broadcast(arm, q, rng, backend):
    v = rng.uniform(-0.5, 0.5, (2, 3, arm.freedom_count))
    moved = integrate(arm, q, v)
    assert moved.shape == (2, 3, arm.coordinate_count)
    assert (moved[1, 2] == integrate(arm, q, v[1, 2])).all()
    np.testing.assert_allclose(difference(arm, moved, q), v, rtol=0, atol=1e-14)
    np.testing.assert_allclose(difference(arm, q, moved), -v, rtol=0, atol=1e-14)
    J = jacobians(arm, moved)
    assert J.shape == (2, 3, arm.joint_count, 6, arm.freedom_count)
    assert (J[1, 2] == jacobians(arm, moved[1, 2])).all()
    assert (jacobian(arm, moved, -1) == J[..., -1, :, :]).all()
    none = np.empty((0, arm.coordinate_count))
    assert jacobian(arm, none, -1).shape == (0, 6, arm.freedom_count)
