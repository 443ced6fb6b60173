"""What a caller leaves out: the solver, the restarts, the effector; and a robot for a model."""

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
    solve_ik,
    track,
)
from plumbob.reference.formats import urdf
from plumbob.reference.inverse_kinematics import RESTARTS
from plumbob.reference.jacobians import difference, integrate, jacobian, jacobians

LINKS = Skeleton([-1, 0, 1, 2], [[0, 0, 0.3], [0, 0, 0.4], [0.4, 0, 0], [0.3, 0, 0]])
AXES = [[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0]]
URDF = """<robot name="two"><link name="base"/><link name="arm"/><link name="hand"/>
<joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="b" type="revolute"><parent link="arm"/><child link="hand"/>
<origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>{more}</robot>"""
FINGERS = """<link name="left"/><link name="right"/>
<joint name="l" type="fixed"><parent link="hand"/><child link="left"/>
<origin xyz="0.2 0 0.1"/></joint>
<joint name="r" type="fixed"><parent link="hand"/><child link="right"/>
<origin xyz="0.2 0 -0.1"/></joint>
"""


def same(one, other):
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.fixture
def robot():
    return urdf.parse(URDF.format(more=""))


@pytest.fixture
def gripper():
    return urdf.parse(URDF.format(more=FINGERS))


def test_the_default_on_a_skeleton_s_one_position_is_fabrik(skeleton, local, rng):
    target = forward_kinematics(skeleton, rotation.random(rng, 6)).positions[-1]
    for wanted in (target, Target(target), [Target(target)]):
        same(solve_ik(skeleton, local, wanted), solve_ik(skeleton, local, target, "fabrik"))


def test_the_default_elsewhere_is_levenberg_marquardt_with_restarts(skeleton, local, rng):
    pose = forward_kinematics(skeleton, rotation.random(rng, 6))
    posed = Target(pose.positions[-1], pose.rotations[-1])
    several = [Target(pose.positions[j], None, j) for j in (4, 5)]
    model = Articulation(LINKS, "hinge", AXES, lower=-2.5, upper=2.5)
    point = forward_kinematics(model, model.random(rng, 30)).positions[:, -1]
    for tree, q, target in (
        (skeleton, local, posed),
        (skeleton, local, [posed]),
        (skeleton, local, several),
        (model, model.neutral(), point),
        (model, model.neutral(), Target(point[0])),
    ):
        ours = solve_ik(tree, q, target, "levenberg_marquardt", restarts=RESTARTS)
        same(solve_ik(tree, q, target), ours)
        one = solve_ik(tree, q, target, "levenberg_marquardt", restarts=0)
        same(solve_ik(tree, q, target, restarts=0), one)
        same(solve_ik(tree, q, target, "levenberg_marquardt"), one)


def test_tracking_defaults_to_ccd_on_a_skeleton_and_else_to_levenberg_marquardt(robot):
    arm, _ = scenes.lab_arm()
    curve = np.linspace([0.3, 0.2, 0.1], [0.4, 0.1, 0.2], 4)
    same(track(arm, curve), track(arm, curve, "ccd"))
    model = robot.articulation
    same(track(model, curve), track(model, curve, "levenberg_marquardt"))


def test_a_robot_is_taken_for_its_articulation(robot):
    model, q = robot.articulation, np.array([0.2, 0.3])
    x = forward_kinematics(model, q).positions[-1]
    same(forward_kinematics(robot, q), forward_kinematics(model, q))
    same(solve_ik(robot, 0.5 * q, x), solve_ik(model, 0.5 * q, x))
    same(track(robot, [x, x]), track(model, [x, x]))
    assert (jacobian(robot, q) == jacobian(model, q)).all()
    assert (jacobians(robot, q) == jacobians(model, q)).all()
    assert (integrate(robot, q, q) == integrate(model, q, q)).all()
    assert (difference(robot, q, 0 * q) == difference(model, q, 0 * q)).all()
    assert judge_pose(robot, q, x).reached


def test_with_several_tips_the_effector_is_to_be_named(gripper):
    q, at = gripper.home, np.zeros(3)
    message = "effector: expected one of the tips left, right, got none"
    for ask in (
        lambda: solve_ik(gripper, q, at),
        lambda: solve_ik(gripper.articulation, q, at),
        lambda: solve_ik(gripper.articulation, q, Target(at)),
        lambda: solve_ik(gripper, q.tolist(), [0, 0, 0]),
        lambda: track(gripper, [at]),
        lambda: jacobian(gripper, q),
        lambda: judge_pose(gripper, q, at),
    ):
        with pytest.raises(ValueError, match=message):
            ask()
    named = solve_ik(gripper, q, at, effector="left")
    same(solve_ik(gripper, q, Target(at, effector="left")), named)
    same(solve_ik(gripper, q, Target(at), effector="left"), named)
    assert solve_ik(gripper, q, at, effector=-1).positions.shape == (5, 3)
