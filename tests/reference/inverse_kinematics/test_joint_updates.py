"""What CCD and FABRIK do joint by joint: never worse, limits kept, one rotation at a branch."""

import numpy as np
import pytest
from drawn_trees import TREES, drawn, with_examples
from hypothesis import given

from plumbob.reference import (
    Articulation,
    Mimic,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    solve_ik,
)
from plumbob.reference.inverse_kinematics.ccd import descend, update_joint
from plumbob.reference.inverse_kinematics.fabrik import (
    fabrik_update,
)
from plumbob.reference.inverse_kinematics.mechanism import cost, update_forward_kinematics

pytestmark = pytest.mark.both_backends

# Squared distances of a few metres, and quaternions normalised after a rotation.
ROUNDING = 1e-12

shared = drawn(max_examples=40)


def planar(links, **limits):
    """Return hinges in a plane, links of one metre along x, a fixed joint at the end."""
    chain = Skeleton(range(-1, links), np.outer([0.0] + [1.0] * links, [1.0, 0.0, 0.0]))
    return Articulation(chain, ["hinge"] * links + ["fixed"], **limits)


# ---- CCD


def updates(machine):
    """Update joint after joint as CCD does; yield the joint and the cost before and after."""
    mechanism, target, data, workspace = machine
    joints = mechanism.joints
    for j in range(len(joints) - 1, -1, -1):
        before = cost(mechanism, target, data)
        if mechanism.joints["followed"][j]:
            descend(mechanism, target, data, workspace, j)
        elif joints["leader"][j] == j:
            update_joint(mechanism, target, data, workspace, j)
        tips = data.positions.copy(), data.rotations.copy()
        yield j, before, cost(mechanism, target, data), tips
    update_forward_kinematics(mechanism, data)


@shared
@with_examples
@given(**TREES)
def test_no_update_of_a_joint_raises_the_cost(articulated, machine, reachable, kinds, seed):
    """Whatever the kind, whatever limits stop it, and whoever follows."""
    model, rng = articulated(kinds, seed), np.random.default_rng(seed)
    targets, _ = reachable(model, rng, 3)
    ready = machine(model, model.random(rng), targets)
    for _ in range(2):
        for _, before, after, _ in updates(ready):
            assert after <= before + ROUNDING


@pytest.mark.parametrize("kind", ["hinge", "slide", "ball", "free"])
def test_an_unlimited_joint_goes_to_the_best_there_is(kind, chain_of_joints, machine, rng):
    """No small move of only the joint, in any direction, lowers the cost."""
    model = chain_of_joints(kind, rng, links=3)
    pose = forward_kinematics(model, model.random(rng))
    targets = [
        Target(pose.positions[3] + rng.standard_normal(3), pose.rotations[3], 3, 2.0),
        Target(pose.positions[2] + rng.standard_normal(3), None, 2, 0.7),
    ]
    ready = machine(model, model.random(rng), targets)
    update_joint(*ready, 1)
    update_forward_kinematics(ready.mechanism, ready.data)
    least, q = cost(*ready[:3]), ready.data.q.copy()
    width = {"hinge": 1, "slide": 1, "ball": 4, "free": 7}[kind]
    for _ in range(20):
        ready.data.q[:] = q
        own = ready.data.q[width : 2 * width]
        own += 1e-3 * rng.standard_normal(width)
        if width > 1:
            own[-4:] /= np.linalg.norm(own[-4:])
        update_forward_kinematics(ready.mechanism, ready.data)
        # A free joint rotates first and then shifts, so that its optimum is one of each apart.
        if kind != "free":
            assert cost(*ready[:3]) >= least - 1e-9


def test_a_free_joint_takes_a_rigid_body_to_its_pose(rng, backend):
    """By rotations and shifts in alternation."""
    body = Articulation(Skeleton([-1, 0], [[0, 0, 0], [0.3, 0.4, 0.5]]), ["free", "fixed"])
    target, q = forward_kinematics(body, body.random(rng)), body.random(rng)
    target = Target(target.positions[1], target.rotations[1])
    solution = solve_ik(body, q, target, "ccd", tolerance=1e-5, tolerance_rotation=1e-5)
    assert solution.outcome is Outcome.CONVERGED


@pytest.mark.parametrize(
    ("start", "upper", "wanted", "expected"),
    [
        (-1.0, 0.5, 0.3, 0.3),  # nothing stops it
        (-1.0, 0.5, 1.2, 0.5),  # the limit stops it on its path
        (0.5, 0.5, 1.2, 0.5),  # it is there already
        (-3.0, 0.5, 2.9, -3.0),  # the smaller angle leads past pi, where the lower limit is
    ],
)
def test_a_hinge_stops_at_its_limit_along_the_arc(start, upper, wanted, expected, backend):
    arm = planar(1, lower=-3.0, upper=upper)
    target = [np.cos(wanted), np.sin(wanted), 0.0]
    solution = solve_ik(arm, [start], target, "ccd", tolerance=0.0, max_iterations=1)
    assert solution.coordinates[0] == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize(("upper", "expected"), [(5.0, 2.0), (1.5, 1.5)])
def test_a_slide_goes_as_far_as_its_limit_allows(upper, expected, backend):
    rail = Articulation(Skeleton([-1], [[1.0, 0, 0]]), "slide", [0, 0, 2.0], upper=upper)
    solution = solve_ik(rail, [0.5], [4.0, 3.0, 2.0], "ccd", max_iterations=1)
    assert solution.coordinates[0] == pytest.approx(expected, abs=1e-15)


def test_inside_a_cone_an_update_that_would_be_worse_is_refused(machine, rng):
    """Cutting the swing of the best rotation down to the cone may lead away from the target."""
    refused = taken = 0
    for _ in range(200):
        ball = Articulation(
            Skeleton([-1, 0], [[0, 0, 0], [1.0, 0.3, 0.2]]), ["ball", "fixed"],
            rotation.rotate(rotation.random(rng), [0.0, 0.0, 1.0]),
            cones=0.8, lower=-0.3, upper=0.5,
        )  # fmt: skip
        target = Target(rotation.rotate(rotation.random(rng), [1.0, 0.3, 0.2]), effector=1)
        ready = machine(ball, ball.random(rng), [target])
        before, q = cost(*ready[:3]), ready.data.q.copy()
        update_joint(*ready, 0)
        assert cost(*ready[:3]) <= before + ROUNDING
        assert ball.within_limits(ready.data.q, 1e-9)
        refused += (ready.data.q == q).all()
        taken += cost(*ready[:3]) < before - 1e-3
    assert refused > 3
    assert taken > 50


@pytest.mark.parametrize("gears", [(0.7, -0.2), (5.0, -3.0)])
def test_a_leader_descends_by_all_that_its_followers_do(gears, machine, rng):
    """A finger curls by one coordinate; where gears are high, a full step would lead too far."""
    finger = Articulation(
        planar(3).skeleton,
        ["hinge"] * 3 + ["fixed"],
        mimics={1: Mimic(0, gears[0]), 2: Mimic(0, gears[1])},
    )
    for _ in range(10):
        q, wanted = rng.uniform(-1.0, 1.0, (2, 1))
        position = forward_kinematics(finger, wanted).positions[3]
        target = [Target(position, effector=3)]
        ready = machine(finger, q, target)
        before = cost(*ready[:3])
        steps = 0
        while cost(*ready[:3]) > 1e-9 and steps < 40:
            last = cost(*ready[:3])
            descend(*ready, 0)
            assert cost(*ready[:3]) <= last + ROUNDING
            steps += 1
        assert cost(*ready[:3]) < before
    assert steps > 0


# ---- FABRIK


def test_forward_a_branch_rotates_all_its_children_alike(machine, rng):
    """A ball with three arms rotates as weighted singular values say (Kabsch 1976)."""
    arms = rng.standard_normal((3, 3))
    tree = Skeleton([-1, 0, 0, 0], np.vstack([np.zeros(3), arms]))
    model, R, weights = Articulation(tree), rotation.random(rng), np.array([0.5, 1.0, 3.0])
    lengths = np.linalg.norm(arms, axis=1, keepdims=True)
    ends = rotation.rotate(R, arms) + 0.3 * rng.standard_normal((3, 3))
    ends *= lengths / np.linalg.norm(ends, axis=1, keepdims=True)
    targets = [Target(ends[k], effector=k + 1, weight=weights[k]) for k in range(3)]
    ready = machine(model, rotation.identity(4).ravel(), targets)
    fabrik_update(ready, ready.target)
    U, _, Vt = np.linalg.svd(np.einsum("k,ki,kj->ij", weights, ends, arms))
    kabsch = rotation.from_matrix(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)
    assert rotation.angle(ready.data.q[:4], kabsch) < 1e-4


@pytest.mark.parametrize("kind", ["hinge", "slide", "ball", "free"])
@pytest.mark.parametrize("oriented", [False, True])
def test_a_pose_that_reaches_all_targets_is_a_fixed_point(
    kind, oriented, chain_of_joints, machine, rng
):
    """The hand is a fixed joint with a frame of its own, attached to the last one that moves."""
    chain = chain_of_joints(kind, rng)
    model = Articulation(
        chain.skeleton, [*[kind] * 4, "fixed"], chain.axes, frames=rotation.random(rng, 5)
    )
    q = model.random(rng)
    pose = forward_kinematics(model, q)
    targets = [
        Target(pose.positions[j], pose.rotations[j] if oriented else None, j) for j in (4, 2)
    ]
    ready = machine(model, q, targets)
    before = ready.data.positions.copy()
    fabrik_update(ready, ready.target)
    np.testing.assert_allclose(ready.data.positions, before, rtol=0, atol=1e-9)


def test_fabrik_rotates_a_hinge_towards_its_child_s_backward_position_within_its_limits(backend):
    for upper, expected in ((2.0, 1.0), (0.4, 0.4)):
        arm = planar(1, lower=-2.0, upper=upper)
        target = [np.cos(1.0), np.sin(1.0), 0.0]
        solution = solve_ik(arm, [-0.5], target, "fabrik", max_iterations=1)
        assert solution.coordinates[0] == pytest.approx(expected, abs=1e-15)


# ---- what is merged and seen
