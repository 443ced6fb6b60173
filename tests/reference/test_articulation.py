"""Joints of all kinds: where coordinates put them, and how limits hold them."""

import numpy as np
import pytest
from drawn_trees import TREES, drawn
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import Articulation, Mimic, Skeleton, forward_kinematics, rotation
from plumbob.reference.articulation import KINDS, clamp_ball, swing_twist

pytestmark = pytest.mark.both_backends

# Where a ball is tilted by nearly pi, its twist is known only to 1e-16 over the rest.
ANGLE = 1e-9

at_both_speeds = drawn()


def one(kind, *, axis=(0.0, 0.0, 1.0), offset=(0.0, 0.0, 0.0), **limits):
    """Return a single joint."""
    return Articulation(Skeleton([-1], [offset]), kind, axis, **limits)


@pytest.fixture
def arm(articulated):
    """Return one joint of each kind, and a mimic slide."""
    model = articulated([*KINDS, "slide"], 7)
    return Articulation(
        model.skeleton, model.kinds, model.axes, frames=model.frames, mimics={5: (2, -0.5, 0.3)}
    )


@pytest.fixture
def q(arm, rng):
    return arm.random(rng)


@at_both_speeds
@given(**TREES)
def test_global_poses_are_products_of_local_transforms(articulated, backend, kinds, seed):
    model = articulated(kinds, seed)
    q = model.random(np.random.default_rng(seed))
    pose, (offsets, local) = forward_kinematics(model, q), model.local_transforms(q)
    for j, p in enumerate(model.skeleton.parents):
        R, x = (pose.rotations[p], pose.positions[p]) if p >= 0 else (rotation.identity(), 0.0)
        np.testing.assert_allclose(pose.positions[j], x + rotation.rotate(R, offsets[j]))
        np.testing.assert_allclose(pose.rotations[j], rotation.multiply(R, local[j]))


def test_coordinates_and_freedoms_are_counted(arm):
    assert arm.coordinate_count == 0 + 1 + 1 + 4 + 7
    assert arm.freedom_count == 0 + 1 + 1 + 3 + 6
    assert [arm.coordinates_of(j) for j in range(6)] == [
        slice(0, 0), slice(0, 1), slice(1, 2), slice(2, 6), slice(6, 13), slice(1, 2),
    ]  # fmt: skip
    assert [arm.freedoms_of(j) for j in range(6)] == [
        slice(0, 0), slice(0, 1), slice(1, 2), slice(2, 5), slice(5, 11), slice(1, 2),
    ]  # fmt: skip
    assert repr(arm) == "Articulation(6 joints, 11 degrees of freedom)"


def test_a_mimic_of_a_mimic_moves_with_the_first(backend):
    chain = Skeleton([-1, 0, 1], np.zeros((3, 3)), ["a", "b", "c"])
    model = Articulation(
        chain, "hinge", mimics={"a": Mimic("b", 2.0, 0.5), "b": Mimic("c", 3.0, -0.25)}
    )
    assert model.mimics == {0: Mimic(2, 6.0, 0.0), 1: Mimic(2, 3.0, -0.25)}
    _, rotations = model.local_transforms([0.1])
    np.testing.assert_allclose(
        rotation.logarithm(rotations)[:, 2], [0.6, 0.05, 0.1], rtol=0, atol=1e-15
    )


def follower_excess(model, q):
    """Return how far coordinates of mimic joints are beyond their own limits, the largest."""
    excess = 0.0
    for j, (leader, multiplier, shift) in model.mimics.items():
        x = multiplier * q[..., model.coordinates_of(leader)] + shift
        excess = max(excess, (model.lower[j] - x).max(), (x - model.upper[j]).max())
    return excess


@at_both_speeds
@given(**TREES)
def test_mimic_joints_keep_their_own_limits(articulated, backend, kinds, seed):
    model, rng = articulated(kinds, seed), np.random.default_rng(seed)
    q = model.random(rng, 20)
    assert follower_excess(model, q) <= ANGLE
    free = Articulation(model.skeleton, model.kinds, mimics=model.mimics)
    q = 2.0 * free.random(rng, 20)
    q[:, model.quaternions] /= 2.0
    assert follower_excess(model, model.clamp(q)) <= ANGLE
    for wild in q:
        beyond = follower_excess(model, wild)
        assert beyond <= ANGLE or not model.within_limits(wild, 0.4 * beyond)


def followed(lower, upper, **mimics):
    """Return three hinges, of which others than the first may be mimics, with limits."""
    tree = Skeleton([-1, 0, 1], np.zeros((3, 3)), ["a", "b", "c"])
    return Articulation(tree, "hinge", lower=lower, upper=upper, mimics=mimics)


@pytest.mark.parametrize(
    ("lower", "upper", "mimics", "expected"),
    [
        ((-2.0, -0.2, -9.0), (2.0, 0.4, 9.0), {"b": ("a",)}, (-0.2, 0.4)),
        ((-2.0, -0.2, -9.0), (2.0, 0.4, 9.0), {"b": ("a", -0.5)}, (-0.8, 0.4)),
        ((-2.0, -0.2, -9.0), (2.0, 0.4, 9.0), {"b": ("a", 1.0, 0.3)}, (-0.5, 0.1)),
        ((-2.0, -0.2, -0.1), (2.0, 0.4, 9.0), {"b": ("a",), "c": ("a", -1.0)}, (-0.2, 0.1)),
        ((-2.0, -1.0, -1.0), (2.0, 0.4, 9.0), {"b": ("a", 2.0), "c": ("b", 2.0)}, (-0.25, 0.2)),
        ((-np.inf, -np.inf, -9.0), (np.inf, 0.5, 9.0), {"b": ("a", -1.0)}, (-0.5, np.inf)),
        ((-2.0, -0.2, -9.0), (2.0, 0.4, 9.0), {"b": ("a", 0.0, 0.4)}, (-2.0, 2.0)),
        ((-np.inf, -1.0, -9.0), (np.inf, 1.0, 9.0), {"b": ("a", 1e-80)}, (-np.inf, np.inf)),
        ((0.0, 0.0, -9.0), (0.5, 0.5, 9.0), {"b": ("a", -1.0)}, (0.0, 0.0)),
        ((0.1, -0.33, -9.0), (0.3, -0.33, 9.0), {"b": ("a", -1.1)}, (0.3, 0.3)),
    ],
)
def test_limits_of_leaders_are_those_in_effect(lower, upper, mimics, expected):
    model = followed(lower, upper, **mimics)
    assert (model.lower[0], model.upper[0]) == pytest.approx(expected, rel=0, abs=1e-15)
    again = Articulation(
        model.skeleton, "hinge", lower=model.lower, upper=model.upper, mimics=model.mimics
    )
    assert (again.lower == model.lower).all()
    assert (again.upper == model.upper).all()
    assert model.within_limits(model.random(np.random.default_rng(1), 5)).all()


@pytest.mark.parametrize("multiplier", [-1e6, 1e3, 0.5, 0.0])
def test_a_follower_is_within_its_limits_to_the_same_tolerance(multiplier, backend):
    """It could be beyond by the multiplier times that of its leader."""
    limit = 0.3 * abs(multiplier)
    model = followed((-1.0, -limit, -1.0), (1.0, limit, 1.0), b=Mimic("a", multiplier))
    edge = 1.0 if multiplier == 0.0 else 0.3
    factor = max(1.0, abs(multiplier))
    q, first = np.array([edge, 0.0]), np.array([1.0, 0.0])
    assert model.within_limits(model.clamp(q + first))
    assert model.within_limits(q + 0.9e-9 / factor * first)
    assert not model.within_limits(q + 1.1e-9 / factor * first)
    assert model.within_limits(-q - 0.9e-7 / factor * first, tolerance=1e-7)


@pytest.mark.parametrize(
    ("lower", "mimic"),
    [(1.0, ("a",)), (0.1, ("a", 0.0)), (0.1, ("a", -1.0)), (1.0, ("a", 1e-80)), (0.0, ("a", 1, 5))],
)
def test_followers_that_no_leader_satisfies_are_refused(lower, mimic):
    with pytest.raises(ValueError, match=r"^mimics: .* 'a' .* follower 'b', got none from 0 to "):
        followed((0.0, lower, 0.0), (0.5, 1.5, 1.0), b=mimic)


@at_both_speeds
@given(**TREES)
def test_clamping_brings_within_limits_and_again_changes_nothing(articulated, backend, kinds, seed):
    model = articulated(kinds, seed)
    free = Articulation(model.skeleton, model.kinds, mimics=model.mimics)
    q = 2.0 * free.random(np.random.default_rng(seed), 5)
    for j in set(range(model.joint_count)) - set(model.mimics):
        if kinds[j] in ("ball", "free"):
            q[:, model.coordinates_of(j)][:, -4:] /= 2.0
    clamped = model.clamp(q)
    assert model.within_limits(clamped, ANGLE).all()
    np.testing.assert_allclose(model.clamp(clamped), clamped, rtol=0, atol=ANGLE)
    inside = model.within_limits(q, 0.0)
    np.testing.assert_allclose(clamped[inside], q[inside], rtol=0, atol=1e-15)


@at_both_speeds
@given(**TREES)
def test_random_coordinates_keep_all_limits(articulated, backend, kinds, seed):
    model = articulated(kinds, seed)
    q = model.random(np.random.default_rng(seed), 20)
    assert model.within_limits(q, ANGLE).all()
    np.testing.assert_allclose(model.clamp(q), q, rtol=0, atol=ANGLE)


@pytest.mark.parametrize(
    ("lower", "upper", "expected"),
    [
        (-2.0, 0.5, (-2.0, 0.5)),
        (-np.inf, np.inf, (-np.pi, np.pi)),
        (1.0, np.inf, (1.0, 1.0 + np.pi)),
        (-1.0, np.inf, (-1.0, np.pi)),
        (-np.inf, -1.0, (-1.0 - np.pi, -1.0)),
        (-np.inf, 1.0, (-np.pi, 1.0)),
        (0.0, -0.0, (0.0, 0.0)),
    ],
)
def test_random_angles_fill_their_range(lower, upper, expected, rng):
    q = one("hinge", lower=lower, upper=upper).random(rng, 1000)
    # Of 1,000 even draws the least is within 2 % of the range but for a chance of 2e-9.
    slack = 0.02 * (expected[1] - expected[0])
    assert expected[0] <= q.min() <= expected[0] + slack
    assert expected[1] - slack <= q.max() <= expected[1]


vectors = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3).map(np.array)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


@given(vector=vectors, axis=directions, cone=st.floats(0.0, 3.0), most=st.floats(0.0, 3.0))
def test_a_clamped_ball_keeps_the_direction_of_its_tilt_and_the_nearer_twist(
    vector, axis, cone, most
):
    Q = tuple(rotation.exponential(vector))
    swing, twist = swing_twist(Q, tuple(axis))
    clamped = clamp_ball(Q, tuple(axis), -most, most, cone)
    again, held = swing_twist(clamped, tuple(axis))
    tilt, kept = rotation.logarithm(swing), rotation.logarithm(again)
    assert held == pytest.approx(np.clip(twist, -most, most), abs=ANGLE)
    angle = np.linalg.norm(tilt)
    shortened = tilt * (cone / angle if angle > cone else 1.0)
    np.testing.assert_allclose(kept, shortened, rtol=0, atol=ANGLE)


@pytest.mark.parametrize(("limit", "over"), [("cones", 0), ("upper", 2), ("lower", 2)])
def test_a_ball_beyond_its_cone_or_its_twist_is_outside(limit, over, backend):
    ball = one("ball", **{limit: -0.4 if limit == "lower" else 0.4})
    sign = -1.0 if limit == "lower" else 1.0
    for angle, within in ((0.39, True), (0.41, False)):
        Q = rotation.exponential(sign * angle * np.eye(3)[over])
        assert ball.within_limits(Q) == within
    clamped = ball.clamp(rotation.exponential(sign * 1.0 * np.eye(3)[over]))
    np.testing.assert_allclose(
        rotation.logarithm(clamped), sign * 0.4 * np.eye(3)[over], rtol=0, atol=1e-15
    )


def test_neutral_is_zero_or_the_nearest_limit():
    chain = Skeleton([-1, 0, 1, 2], np.zeros((4, 3)))
    model = Articulation(
        chain, ["free", "hinge", "ball", "slide"], lower=[-1, 1, -1, -2], upper=[1, 2, 1, -1]
    )
    np.testing.assert_array_equal(model.zero(), [0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0])
    np.testing.assert_array_equal(model.neutral(), [0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, -1])
    assert model.limited
    assert not one("hinge").limited


def test_a_batch_is_its_poses(arm, rng, backend):
    q = arm.random(rng, 2, 3)
    for of in (arm.forward, arm.local_transforms, lambda q: (arm.clamp(q), arm.within_limits(q))):
        for all_at_once, single in zip(of(q), of(q[1, 2]), strict=True):
            assert all_at_once.shape[:2] == (2, 3)
            assert (all_at_once[1, 2] == single).all()
    assert forward_kinematics(arm, np.empty((0, 13))).positions.shape == (0, 6, 3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kinds": ["hinge"]}, "kinds: expected 3 kinds, one a joint, got 1"),
        ({"axes": np.ones((2, 3))}, r"axes: expected one, or one for each of 3 joints, got \(2,\)"),
        ({"frames": rotation.identity(2)}, "frames: expected one, or one for each of 3 joints"),
        ({"lower": [1.0, 2.0]}, "lower: expected one, or one for each of 3 joints"),
        ({"lower": 3.2}, "lower: expected limits of a ball's twist .* got 3.2 to inf for joint 2"),
        ({"upper": -3.2}, "lower: expected limits of a ball's twist .* got -inf to -3.2"),
        ({"cones": [1.0, 2.0]}, "cones: expected one, or one for each of 3 joints"),
        ({"mimics": {1: Mimic("hip")}}, "mimics: expected one of .* got 'hip'"),
        ({"mimics": {1: Mimic(2)}}, "mimics: expected hinges or slides, got 'ball' for joint 2"),
        ({"mimics": {2: Mimic(1)}}, "mimics: expected hinges or slides, got 'ball' for joint 2"),
        ({"mimics": {0: Mimic(1), 1: Mimic(0)}}, "mimics: expected a leader, got .* in a ring"),
        ({"mimics": {1: Mimic(1)}}, "mimics: expected a leader, got 'joint1' in a ring"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    tree = Skeleton([-1, 0, 1], np.ones((3, 3)))
    with pytest.raises(ValueError, match=message):
        Articulation(**{"skeleton": tree, "kinds": ["hinge", "slide", "ball"]} | arguments)
