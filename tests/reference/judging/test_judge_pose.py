"""Answers of others are judged by distances, whatever their precision."""

import numpy as np
import pytest

from plumbob.reference import (
    Articulation,
    Skeleton,
    Target,
    forward_kinematics,
    judge_pose,
    rotation,
    scenes,
)

# A few roundings of float32, over arms of 2.6 m.
SINGLE = 1e-6


@pytest.fixture
def arm():
    return scenes.lab_arm()[0]


def drifted(rng):
    """Return rotations of the arm in float32, as off unit length as after a thousand products."""
    return (rotation.random(rng, 5) * rng.uniform(1 - 2e-5, 1 + 2e-5, (5, 1))).astype(np.float32)


def test_answers_in_single_precision_are_judged_where_inputs_are_refused(arm, rng):
    for _ in range(20):
        given = drifted(rng)
        with pytest.raises(ValueError, match="unit quaternions"):
            forward_kinematics(arm, given)
        exact = given / np.linalg.norm(given.astype(float), axis=1, keepdims=True)
        tip = forward_kinematics(arm, exact).positions[-1]
        judged = judge_pose(arm, given, tip)
        assert judged.reached
        assert judged.distance <= 1e-14
        off = np.abs(np.linalg.norm(given.astype(float), axis=1) - 1.0).max()
        assert judged.norm_deviation == pytest.approx(off, rel=1e-9)


def test_the_distance_and_angle_are_those_by_forward_kinematics(arm, rng):
    local = rotation.random(rng, 5)
    targets = [Target([0.3, 0.1, 0.2], rotation.random(rng), 3), Target([1.0, 0.2, 0.0], None, 4)]
    pose, judged = forward_kinematics(arm, local), judge_pose(arm, local, targets)
    expected = [np.linalg.norm(pose.positions[t.effector] - t.position) for t in targets]
    np.testing.assert_allclose(judged.distances, expected, rtol=1e-14)
    angle = rotation.angle(pose.rotations[3], targets[0].rotation)
    np.testing.assert_allclose(judged.angles, [angle, 0.0], rtol=1e-14)
    assert (judged.distance, judged.angle) == (max(expected), angle)
    assert not judged.reached
    assert "is not reached" in judged.summary


def test_broken_limits_are_told_by_how_much():
    links = Skeleton([-1, 0, 1, 2], np.eye(4, 3))
    model = Articulation(links, ["hinge", "slide", "ball", "hinge"], lower=-0.5, upper=0.5)
    q = np.concatenate([[0.7], [-1.5], rotation.exponential([0.0, 0.0, 0.75]), [0.9]])
    judged = judge_pose(model, q, [0.0, 0.0, 0.0])
    np.testing.assert_allclose(judged.limit_excess, [0.2, 1.0, 0.25, 0.4], atol=1e-15)
    assert "4 joints are beyond their limits, joint1 by 1" in judged.summary
    assert (judge_pose(model, model.neutral(), [0, 0, 0]).limit_excess == 0.0).all()


def test_positions_that_are_not_the_pose_s_are_told(arm, rng):
    local = rotation.random(rng, 5)
    x = forward_kinematics(arm, local).positions.copy()
    same = judge_pose(arm, local, x[-1], positions=x.astype(np.float32))
    assert same.position_error <= SINGLE
    assert same.length_error <= SINGLE
    x[4] += 0.25 * (x[4] - x[3]) / np.linalg.norm(x[4] - x[3])
    longer = judge_pose(arm, local, x[-1], positions=x)
    assert longer.position_error == pytest.approx(0.25)
    assert longer.length_error == pytest.approx(0.25)
    assert not longer.reached  # a tip that the rotations do not lead to reaches nothing
    for errors in (longer.position_errors, longer.length_errors):
        assert errors == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.25])
    alone = judge_pose(arm, None, x[-1], positions=x)
    assert alone.reached
    assert (alone.position_error, alone.length_errors[4]) == (None, pytest.approx(0.25))
    assert (alone.positions == x).all()


def test_a_link_that_slides_may_be_longer_and_no_other():
    """Lengths are the fourth link's 1 m, and what the slide adds along its axis."""
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]])
    model = Articulation(links, ["hinge", "slide", "hinge", "hinge"], [1, 0, 0])
    x = forward_kinematics(model, [0.0, 0.7, 0.0, 0.0]).positions.copy()
    x[3, 0] += 0.25
    judged = judge_pose(model, [0.0, 0.7, 0.0, 0.0], x[3], positions=x)
    np.testing.assert_allclose(judged.length_errors, [0.0, 0.0, 0.0, 0.25], atol=1e-15)


def test_each_tolerance_is_for_its_own_error(arm, rng):
    """A target 1e-3 m and 0.01 rad away is reached within 0.002 m and 0.02 rad."""
    local = rotation.random(rng, 5)
    pose = forward_kinematics(arm, local)
    turn = rotation.multiply(rotation.exponential([0.01, 0.0, 0.0]), pose.rotations[4])
    target = Target(pose.positions[4] + [0.0, 1e-3, 0.0], turn, 4)
    for far, turned, reached in ((2.0, 2.0, True), (0.5, 2.0, False), (2.0, 0.5, False)):
        tolerances = {"tolerance": 1e-3 * far, "tolerance_rotation": 0.01 * turned}
        assert judge_pose(arm, local, target, **tolerances).reached is reached


@pytest.mark.parametrize("size", [1e-300, 1e-5, 1.0, 1e75])
def test_normalise_makes_unit_and_tells_how_far_off_it_was(size, rng):
    q = rotation.random(rng, 3, 5)
    unit, deviation = rotation.normalise(size * q)
    np.testing.assert_allclose(unit, q, rtol=1e-14)
    np.testing.assert_allclose(deviation, np.abs(size - 1.0), rtol=1e-14, atol=4e-16)
    assert deviation.shape == (3, 5)
