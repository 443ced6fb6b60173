"""All solutions of a pose: laws of the list, closed forms against searches, singular poses."""

import copy
import pickle
from functools import partial

import numpy as np
import pytest

from plumbob import (
    Articulation,
    Mimic,
    Skeleton,
    Target,
    all_solutions,
    prepare_all_solutions,
    solve_ik,
)
from plumbob.reference import forward_kinematics, rotation, set_backend
from plumbob.reference.inverse_kinematics.branches.closed_forms import FORMS

WRIST, PARALLEL = FORMS
X, Y, Z = np.eye(3)
# Axes and points on them with all joints at zero, by the makers' published dimensions [m].
ARMS = {
    "UR5": ([Z, Y, Y, Y, -Z, Y], [[0, 0, 0.089], [0, 0.136, 0.089], [0.425, 0.016, 0.089],
            [0.817, 0.016, 0.089], [0.817, 0.109, 0.089], [0.817, 0.109, -0.006]], PARALLEL),
    "Puma 560": ([Z, -Y, -Y, Z, -Y, Z], [[0, 0, 0], [0, 0.244, 0], [0.432, 0.15, 0],
                 [0.412, 0.15, 0.432], [0.412, 0.15, 0.432], [0.412, 0.15, 0.432]], WRIST),
    "offset shoulder": ([Z, Y, Y, X, Y, X], [[0, 0, 0.4], [0.025, 0, 0.4], [0.025, 0, 0.855],
                        [0.445, 0, 0.89], [0.445, 0, 0.89], [0.525, 0, 0.89]], WRIST),
    "skew": ([Z, [0.2, 0.9, 0.3], [0.5, 0.3, 0.7], X, [0.3, 0.8, 0.1], Z], [[0, 0, 0.1],
             [0.1, 0.2, 0.3], [0.4, 0.1, 0.3], [0.7, 0.2, 0.5], [0.7, 0.2, 0.5], [0.7, 0.2, 0.5]],
             WRIST),
    "Jaco-like wrist": ([Z, Y, Y, X, [1, 0, 1], X], [[0, 0, 0.2], [0, 0, 0.2], [0, 0, 0.6],
                        [0.3, 0.01, 0.6], [0.3, 0.01, 0.6], [0.3, 0.01, 0.6]], WRIST),
}  # fmt: skip
SEVEN = [Z, Y, Z, -Y, Z, Y, Z], [[0, 0, h] for h in (0.15, 0.36, 0.56, 0.78, 0.96, 1.18, 1.3)]
GENERAL = [Z, [0.1, 1, 0], [0.2, 1, 0.3], [1, 0.2, 0], [0, 1, 0.2], X], [
    [0, 0, 0.2], [0.1, 0, 0.3], [0.5, 0.05, 0.3], [0.6, 0, 0.4], [0.9, 0.1, 0.35], [1, 0, 0.4],
]  # fmt: skip
LIMIT = np.pi
# Forward kinematics of an arm of a metre rounds to 1e-15; the function promises 1e-9.
REACHED = 1e-9
# A coordinate is a root, whose condition number is up to 1e6 in random poses, or a double root.
SAME = 1e-6


def arm_of(axes, points, lower=-LIMIT, upper=LIMIT, base=(1.0, 0.0, 0.0, 0.0), backwards=False):
    """Return an arm with a tool, turned by its base; backwards from its tool to its base."""
    axes, points = np.array(axes, dtype=float), np.array(points, dtype=float)
    if backwards:
        axes, points = -axes[::-1], points[::-1] - points[-1]
    points = np.vstack([points, points[-1] + [0.05, 0.1, -0.02]])
    offsets = np.diff(points, axis=0, prepend=np.zeros((1, 3)))
    count = len(axes)
    frames = rotation.identity(count + 1)
    offsets[0], frames[0] = rotation.rotate(np.array(base), offsets[0]), base
    frames[-1] = rotation.exponential(np.array([0.3, -0.5, 0.8]))
    kinds = [*["hinge"] * count, "fixed"]
    skeleton = Skeleton(range(-1, count), offsets)
    axes = np.vstack([axes, Z])
    return Articulation(skeleton, kinds, axes, frames=frames, lower=lower, upper=upper)


def target_of(arm, q):
    pose = forward_kinematics(arm, q)
    return Target(pose.positions[-1], pose.rotations[-1])


def differences(a, b):
    """Return the largest difference of angles of each row of a from each row of b."""
    turns = a[:, None] - b[None]
    return np.abs(turns - 2.0 * np.pi * np.round(turns / (2.0 * np.pi))).max(axis=-1)


def assert_lists(solutions, arm, target, q=None):
    """Check the laws of a list: poses, limits, no duplicates, and that it has q."""
    pose = forward_kinematics(arm, solutions.coordinates)
    distance = np.linalg.norm(pose.positions[:, -1] - target.position, axis=-1)
    angle = rotation.angle(pose.rotations[:, -1], target.rotation)
    assert distance.max(initial=0.0) <= 2.0 * REACHED  # of a reach below two metres
    assert angle.max(initial=0.0) <= REACHED
    np.testing.assert_allclose(solutions.residual, distance, atol=1e-14)
    assert arm.within_limits(solutions.coordinates).all()
    apart = differences(solutions.coordinates, solutions.coordinates)
    assert (apart + 9.0 * np.eye(len(apart))).min(initial=9.0) > SAME
    if q is not None:
        assert differences(solutions.coordinates, q[None]).min(initial=9.0) < SAME


def assert_same(a, b):
    """Check that two lists have the same bits."""
    for values, expected in zip(a, b, strict=True):
        np.testing.assert_equal(values, expected)


def row_of(target):
    return np.array([*target.position, *target.rotation])


@pytest.fixture(params=ARMS)
def named(request):
    return request.param


@pytest.mark.parametrize("backwards", [False, True], ids=["forwards", "backwards"])
def test_a_closed_form_lists_the_pose_that_made_the_target(named, backwards, rng):
    *geometry, method = ARMS[named]
    arm, moved = arm_of(*geometry, backwards=backwards), []
    for q in arm.random(rng, 30):
        target = target_of(arm, q)
        solutions = all_solutions(arm, target)
        assert_lists(solutions, arm, target, q)
        assert (solutions.method, solutions.complete, solutions.unseen) == (method, True, 0.0)
        assert len(solutions.coordinates) <= 8
        assert len(solutions.coordinates) % 2 == 0  # isolated solutions of 6R arms come in pairs
        moved.append(len(solutions.coordinates))
    assert max(moved) > 2


@pytest.mark.parametrize(
    ("targets", "starts"), [(2, 60), pytest.param(60, 600, marks=pytest.mark.slow)]
)
def test_no_search_finds_more_than_a_closed_form(named, targets, starts, rng):
    arm = arm_of(*ARMS[named][:2])
    for q in arm.random(rng, targets):
        target = target_of(arm, q)
        solutions = all_solutions(arm, target).coordinates
        ends = solve_ik(arm, arm.random(rng, starts), target, tolerance=1e-11,
                        tolerance_rotation=1e-11, restarts=0)  # fmt: skip
        ends = ends.coordinates[(ends.residual < 1e-10) & (ends.residual_rotation < 1e-10)]
        assert len(ends) > starts // 4
        assert differences(ends, solutions).min(axis=1).max() < 1e-5


# Arms whose solutions are continua in every pose: a joint moves nothing that others do not.
ALWAYS_SINGULAR = {
    "third axis through the wrist": ([Z, Y, Y, X, Y, Z], [[0, 0, 0.2], [0.1, 0, 0.3],
                                     *[[0.4, 0, 0.6]] * 4]),
    "two wrists": ([Z, Y, X, Z, Y, X], [*[[0, 0, 0.2]] * 3, *[[0.5, 0.1, 0.3]] * 3]),
    "three parallel axes and a wrist": ([Z, Z, Z, X, Y, Z], [[0, 0, 0.2], [0.3, 0, 0.2],
                                        [0.5, 0.1, 0.2], *[[0.7, 0, 0.3]] * 3]),
    "four parallel axes": ([Y, Y, Y, Y, Z, X], [[0, 0, 0.1], [0.1, 0, 0.3], [0.5, 0, 0.3],
                           [0.7, 0, 0.4], [0.8, 0, 0.4], [0.8, 0, 0.4]]),
}  # fmt: skip


@pytest.mark.parametrize("backwards", [False, True], ids=["forwards", "backwards"])
@pytest.mark.parametrize("name", ALWAYS_SINGULAR)
def test_an_arm_that_is_singular_in_every_pose_has_no_complete_list(name, backwards, rng):
    arm = arm_of(*ALWAYS_SINGULAR[name], backwards=backwards)
    for q in arm.random(rng, 3):
        target = target_of(arm, q)
        solutions = all_solutions(arm, target, restarts=8)
        assert_lists(solutions, arm, target)
        assert not solutions.complete


def test_bases_and_tools_change_nothing(named, rng):
    geometry = ARMS[named][:2]
    base, arm = rotation.random(rng), arm_of(*geometry)
    turned = arm_of(*geometry, base=base)
    target = target_of(arm, arm.random(rng))
    moved = Target(*(turn(base, x) for turn, x in zip(
        (rotation.rotate, rotation.multiply), target[:2], strict=True)))  # fmt: skip
    a, b = (all_solutions(*pair).coordinates for pair in ((arm, target), (turned, moved)))
    assert len(a) == len(b) > 0
    assert differences(a, b).min(axis=1).max() < SAME


def test_limits_keep_those_within_them(named, rng):
    geometry = ARMS[named][:2]
    arm, narrow = arm_of(*geometry), arm_of(*geometry, lower=-1.5, upper=2.5)
    kept = 0
    for q in narrow.random(rng, 10):
        target = target_of(arm, q)
        everything, within = all_solutions(arm, target), all_solutions(narrow, target)
        expected = everything.coordinates[narrow.within_limits(everything.coordinates)]
        assert len(expected) == len(within.coordinates)
        assert differences(expected, within.coordinates).min(axis=1).max() < SAME
        kept += len(expected) < len(everything.coordinates)
    assert kept > 0


@pytest.mark.parametrize(
    ("beyond", "is_listed", "is_complete"),
    [(-1e-5, True, True), (5e-10, True, True), (1e-7, False, False), (1e-5, False, True)],
)
def test_a_solution_just_beyond_a_limit_leaves_the_list_in_doubt(beyond, is_listed, is_complete):
    """A limit counts as kept to 1e-9; within 1e-6 of it rounding may have moved the solution."""
    arm = arm_of(*ARMS["UR5"][:2])
    q = np.array([0.3, -1.0, 0.8, 0.5, 0.9, 0.4])
    narrow = arm_of(*ARMS["UR5"][:2], upper=[LIMIT, LIMIT, q[2] - beyond, *[LIMIT] * 4])
    solutions = all_solutions(narrow, target_of(arm, q))
    distances = differences(solutions.coordinates, q[None])
    assert (distances.min(initial=9.0) < SAME) == is_listed
    assert solutions.complete == is_complete
    assert len(solutions.coordinates) > 0


@pytest.mark.parametrize("bend", [2e-6, 1e-4])
def test_solutions_that_nearly_meet_are_two(bend):
    """The elbow of a nearly straight arm bends either way, and candidates come to both."""
    q = np.array([0.3, -1.0, bend, 0.5, 0.9, 0.4])
    arm = arm_of(*ARMS["UR5"][:2])
    listed = all_solutions(arm, target_of(arm, q)).coordinates
    near = listed[differences(listed, q[None])[:, 0] < 10.0 * bend]
    np.testing.assert_allclose(np.sort(near[:, 2]), [-bend, bend], rtol=1e-2)


TURN = 2.0 * np.pi
# Limits, and the number of revolutions of each hinge within them.
WIDE = {
    "plus and minus a revolution": (-TURN, TURN, 2),
    "a revolution away": (np.pi, 3.0 * np.pi, 1),
    "three revolutions below zero": (-3.0 * TURN, 0.0, 3),
    "no limits": (-np.inf, np.inf, 1),
    "a lower limit": (10.0, np.inf, 1),
}


@pytest.mark.parametrize("limits", WIDE)
def test_whole_turns_within_the_limits_are_added(limits, named, rng):
    lower, upper, turns = WIDE[limits]
    # two joints keep half a revolution each, so that all rows are few
    arm = arm_of(*ARMS[named][:2], [lower] * 4 + [-np.pi] * 3, [upper] * 4 + [np.pi] * 3)
    q = arm.random(rng)
    target = target_of(arm, q)
    solutions = all_solutions(arm, target)
    assert_lists(solutions, arm, target, q)
    assert solutions.complete
    rows = np.array(list(solutions.with_turns()))
    assert len(rows) == turns**4 * len(solutions.coordinates)
    assert arm.within_limits(rows).all()
    pose = forward_kinematics(arm, rows)
    assert np.linalg.norm(pose.positions[:, -1] - target.position, axis=-1).max() <= 2.0 * REACHED
    assert rotation.angle(pose.rotations[:, -1], target.rotation).max() <= REACHED
    apart = np.abs(rows[:, None] - rows).max(axis=-1)
    assert (apart + 9.0 * np.eye(len(rows))).min() > SAME
    if np.isfinite(upper):
        assert np.abs(rows - q).max(axis=1).min() < SAME


def test_a_leader_s_revolution_is_another_pose(rng):
    listed = 0
    for _ in range(4):
        skeleton = Skeleton(range(-1, 7), 0.3 * rng.standard_normal((8, 3)))
        arm = Articulation(skeleton, "hinge", rng.standard_normal((8, 3)), lower=-6.0, upper=6.0,
                           mimics={3: Mimic(1, 0.5, 0.2), 6: Mimic(5, 0.3)})  # fmt: skip
        q = arm.random(rng)
        target = target_of(arm, q)
        solutions = all_solutions(arm, target, restarts=512)
        assert_lists(solutions, arm, target)
        leaders = [arm.coordinates_of(j).start for j in (1, 5)]
        near = differences(solutions.coordinates, q[None])[:, 0] < SAME
        listed += (np.abs(solutions.coordinates - q)[near][:, leaders] < SAME).all(axis=1).any()
        rows = np.array(list(solutions.with_turns()))
        assert np.isin(rows[:, leaders], solutions.coordinates[:, leaders]).all()
        x = forward_kinematics(arm, rows).positions[:, -1]
        assert np.linalg.norm(x - target.position, axis=-1).max() < 1e-7
    assert listed == 4


def test_both_backends_agree(named, rng):
    arm = arm_of(*ARMS[named][:2])
    target = target_of(arm, arm.random(rng))
    compiled = all_solutions(arm, target)
    with set_backend("python"):
        plain, solve = all_solutions(arm, target), prepare_all_solutions(arm)
    assert_same(solve(row_of(target)), plain)  # which keeps the backend
    np.testing.assert_allclose(plain.coordinates, compiled.coordinates, atol=1e-9)


# The third angle at which 0.025 + 0.42 cos + 0.035 sin = 0: the wrist is on the first axis.
ABOVE = np.arctan2(0.035, 0.42) + np.arccos(-0.025 / np.hypot(0.42, 0.035))
SINGULAR = {
    "wrist of UR5": ("UR5", [0.3, -1.0, 0.8, 0.5, 0.0, 0.4], True),
    "straight elbow of UR5": ("UR5", [0.3, -1.0, 0.0, 0.5, 0.9, 0.4], False),
    "wrist of Puma": ("Puma 560", [0.3, -1.0, 0.8, 0.5, 0.0, 0.4], True),
    "wrist of the offset arm": ("offset shoulder", [0.3, -1.0, 0.8, 0.5, 0.0, 0.4], True),
    "wrist above the base": ("offset shoulder", [0.3, 0.0, ABOVE, 0.5, 0.7, 0.4], True),
}


@pytest.mark.parametrize(("name", "q", "continuum"), SINGULAR.values(), ids=SINGULAR)
def test_singular_poses_are_said(name, q, continuum):
    arm, q = arm_of(*ARMS[name][:2]), np.array(q)
    target = target_of(arm, q)
    solutions = all_solutions(arm, target)
    assert_lists(solutions, arm, target, None if continuum else q)
    assert len(solutions.coordinates) > 0
    assert solutions.continuum == continuum
    assert not solutions.complete


# Poses in which no candidate of the closed form comes to a solution: the angle that nothing
# determines has none at zero, or an angle is lost to rounding.
EMPTY = {
    "wrist of UR5, q6 = 0 out of reach": ("UR5", False, [
        -2.361114425521, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 2.484619573405]),
    "shoulder and wrist of Jaco": ("Jaco-like wrist", False, [
        -2.8741050312721925, -1.5707963267948966, 1.5707963427618716, -2.540797097963117,
        3.141592653589793, -1.5707963267948966]),
}  # fmt: skip


@pytest.mark.parametrize(("name", "backwards", "q"), EMPTY.values(), ids=EMPTY)
def test_near_singular_poses_without_a_candidate_are_searched(name, backwards, q):
    arm = arm_of(*ARMS[name][:2], backwards=backwards)
    target = target_of(arm, np.array(q))
    solutions = all_solutions(arm, target)
    assert_lists(solutions, arm, target)
    assert len(solutions.coordinates) > 0
    assert (solutions.method, solutions.complete) == ("restarts", False)
    assert_same(prepare_all_solutions(arm)(row_of(target)), solutions)


@pytest.mark.parametrize("count", [60, pytest.param(6000, marks=pytest.mark.slow)])
def test_a_list_that_is_complete_has_the_pose_however_singular(named, count, rng):
    arm, is_complete = arm_of(*ARMS[named][:2]), []
    for _ in range(count):
        q, is_special = arm.random(rng), rng.random(6) < 0.5
        q[is_special] = rng.choice([0.0, np.pi / 2, -np.pi / 2, np.pi], is_special.sum())
        q += rng.choice([0.0, 10.0 ** rng.uniform(-12.0, -2.0)]) * rng.standard_normal(6)
        q = arm.clamp(q)
        target = target_of(arm, q)
        solutions = all_solutions(arm, target)
        assert_lists(solutions, arm, target)
        assert len(solutions.coordinates) > 0
        near = differences(solutions.coordinates, q[None]).min(initial=9.0) < 10.0 * SAME
        assert near or not solutions.complete
        is_complete.append(solutions.complete)
    assert 0.3 < np.mean(is_complete) < 1.0 or named == "skew"


def test_axes_that_nearly_coincide_in_a_pose_leave_the_list_in_doubt(rng):
    # the Panda's first six joints [m]: with the elbow at zero, axes 3 and 5 are one
    points = [*[[0, 0, 0.333]] * 3, [0.0825, 0, 0.649], *[[0, 0, 1.033]] * 2]
    arm = arm_of([Z, Y, Z, -Y, Z, -Y], points, lower=-1.2, upper=2.0)
    for _ in range(300):
        q = arm.random(rng)
        q[3] = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-11.0, -6.0)
        target = target_of(arm, q)
        solutions = all_solutions(arm, target)
        assert_lists(solutions, arm, target)
        near = differences(solutions.coordinates, q[None]).min(initial=9.0) < 10.0 * SAME
        assert near or not solutions.complete


def test_out_of_reach_there_is_no_solution(named):
    arm = arm_of(*ARMS[named][:2])
    solutions = all_solutions(arm, Target([3.0, 2.0, 1.0], rotation.identity()))
    assert solutions.coordinates.shape == (0, 6)
    assert solutions.complete
    assert not solutions.continuum


@pytest.mark.parametrize("joint", range(7))
def test_seven_joints_are_solved_on_a_grid(joint, rng):
    arm = arm_of(*SEVEN)
    q = arm.random(rng)
    target, values = target_of(arm, q), np.array([q[joint], 0.4])
    solutions = all_solutions(arm, target, grid={joint: values})
    is_elbow = joint == 3  # which the target alone determines: a continuum goes through q
    assert_lists(solutions, arm, target, None if is_elbow else q)
    assert solutions.continuum == is_elbow
    assert np.isin(solutions.coordinates[:, joint], values).all()
    assert list(solutions.grid) == [arm.names[joint]]


def test_the_default_grid_is_of_a_redundant_joint_and_stated(rng):
    arm = arm_of(*SEVEN)
    target = target_of(arm, arm.random(rng))
    solutions = all_solutions(arm, target)
    assert_lists(solutions, arm, target)
    ((name, values),) = solutions.grid.items()
    joint = arm.index(name)
    assert joint != 3  # the elbow's angle is given by the distance of the wrist
    assert solutions.complete
    assert set(solutions.coordinates[:, joint]) <= set(values)
    repeated = all_solutions(arm, target, grid={name: values})
    np.testing.assert_array_equal(repeated.coordinates, solutions.coordinates)


@pytest.mark.parametrize(
    ("targets", "dense"), [(1, 512), pytest.param(20, 4096, marks=pytest.mark.slow)]
)
def test_a_search_states_its_coverage(targets, dense, rng):
    arm = arm_of(*GENERAL)
    for q in arm.random(rng, targets):
        target = target_of(arm, q)
        solutions = all_solutions(arm, target)
        assert_lists(solutions, arm, target)
        assert (solutions.method, solutions.complete) == ("restarts", False)
        more = all_solutions(arm, target, restarts=dense, seed=1)
        assert_lists(more, arm, target, q)
        assert 0.0 <= more.unseen < 0.02
        missing = differences(more.coordinates, solutions.coordinates).min(axis=1) > SAME
        assert missing.sum() <= 1 + (solutions.unseen > 0.01)


@pytest.mark.parametrize("restarts", [1, 12, 40])
@pytest.mark.parametrize("seed", [0, 3])
def test_what_is_unseen_is_the_share_of_solutions_found_once(restarts, seed, rng):
    """The starts are drawn and solved here as well, and counted by their ends."""
    arm = arm_of(*GENERAL)
    target = target_of(arm, arm.random(rng))
    solutions = all_solutions(arm, target, restarts=restarts, seed=seed)
    starts = arm.random(np.random.default_rng(seed), restarts)
    ends = solve_ik(arm, starts, target, "levenberg_marquardt", tolerance=1e-6,
                    tolerance_rotation=1e-6, restarts=0, max_iterations=1000)  # fmt: skip
    solved = ends.coordinates[(ends.residual <= 1e-6) & (ends.residual_rotation <= 1e-6)]
    hits = (differences(solved, solutions.coordinates) < 1e-3).sum(axis=0)
    assert hits.sum() == len(solved)
    assert solutions.unseen == ((hits == 1).sum() / hits.sum() if hits.sum() else 1.0)


def test_slides_and_joints_that_follow_others_are_searched(rng):
    skeleton = Skeleton(range(-1, 7), 0.3 * rng.standard_normal((8, 3)))
    kinds = ["slide", "hinge", "slide", "hinge", "hinge", "hinge", "hinge", "hinge"]
    arm = Articulation(skeleton, kinds, rng.standard_normal((8, 3)), lower=-1.0, upper=1.0,
                       mimics={3: Mimic(1, 0.5, 0.2), 6: Mimic(5)})  # fmt: skip
    q = arm.random(rng)
    solutions = all_solutions(arm, target_of(arm, q))
    assert_lists(solutions, arm, target_of(arm, q), q)
    assert solutions.method == "restarts"
    locked = all_solutions(arm, target_of(arm, q), grid={1: q[1]}, restarts=64)
    assert_lists(locked, arm, target_of(arm, q), q)


def test_other_joints_stay_at_neutral(rng):
    axes, points, _ = ARMS["UR5"]
    alone = arm_of(axes, points)
    offsets = np.vstack([alone.skeleton.offsets, [0.1, 0.0, 0.0]])
    arm = Articulation(
        Skeleton([*alone.skeleton.parents, 2], offsets), [*alone.kinds, "ball"],
        np.vstack([alone.axes, Z]), frames=np.vstack([alone.frames, rotation.identity()]),
    )  # fmt: skip
    target = target_of(alone, alone.random(rng))
    solutions = all_solutions(arm, target, effector=6)
    expected = all_solutions(alone, target).coordinates
    np.testing.assert_allclose(solutions.coordinates[:, :6], expected, atol=1e-9)
    np.testing.assert_array_equal(solutions.coordinates[:, 6:], [[1, 0, 0, 0]] * len(expected))


# Arms, and settings of `all_solutions`: closed forms, a search, a grid.
PREPARED = {
    **{name: (geometry[:2], {}) for name, geometry in ARMS.items()},
    "general": (GENERAL, {"restarts": 12, "seed": 3}),
    "seven": (SEVEN, {"grid": {2: [0.1, 0.4]}, "effector": 7}),
}


@pytest.mark.parametrize("name", PREPARED)
def test_prepared_lists_are_those_of_all_solutions(name, rng):
    geometry, settings = PREPARED[name]
    arm = arm_of(*geometry)
    solve = prepare_all_solutions(arm, **settings)
    targets = [target_of(arm, q) for q in arm.random(rng, 4)]
    targets += [
        Target([3.0, 2.0, 1.0], rotation.identity()),
        target_of(arm, np.zeros(arm.coordinate_count)),
    ]
    for target in targets:
        expected = all_solutions(arm, target, **settings)
        for form in (row_of(target), row_of(target).tolist()):
            solutions = solve(form)
            assert_same(solutions, expected)
            assert not any(values.flags.writeable for values in solutions[:3])


def test_prepared_lists_share_their_arrays(named, rng):
    """A kernel fills the arrays of the first list again; lists of `all_solutions` stay."""
    arm = arm_of(*ARMS[named][:2])
    solve, first, second = (
        prepare_all_solutions(arm),
        *(target_of(arm, q) for q in arm.random(rng, 2)),
    )
    kept, shared = all_solutions(arm, first), solve(row_of(first))
    assert_same(shared, kept)
    expected = all_solutions(arm, second)
    assert_same(solve(row_of(second)), expected)
    count = min(len(shared.coordinates), len(expected.coordinates))
    np.testing.assert_array_equal(shared.coordinates[:count], expected.coordinates[:count])
    assert (kept.coordinates[:count] != expected.coordinates[:count]).any()


@pytest.mark.parametrize(
    "duplicate", [copy.copy, copy.deepcopy, lambda solve: pickle.loads(pickle.dumps(solve))]
)
def test_a_copy_of_a_prepared_robot_has_arrays_of_its_own(duplicate, rng):
    arm = arm_of(*ARMS["UR5"][:2])
    targets = [target_of(arm, q) for q in arm.random(rng, 2)]
    solve = prepare_all_solutions(arm)
    lists = solve(row_of(targets[0])), duplicate(solve)(row_of(targets[1]))
    for solutions, target in zip(lists, targets, strict=True):
        assert_same(solutions, all_solutions(arm, target))


# Axes meet only to this, as of robot files: candidates off by less than 1e-12 are not polished.
OFF = 1e-13


@pytest.mark.parametrize("name", ["Puma 560", "offset shoulder"])
def test_a_candidate_beyond_a_limit_is_polished(name, rng):
    """Near a singular pose a candidate that is 1e-13 off has angles 1e-9 beyond limits."""
    axes, points, _ = ARMS[name]
    q = np.array([0.3, -1.0, 0.8, 0.5, 1.6e-4, 0.4])
    for _ in range(20):
        arm = arm_of(axes, points + OFF * rng.standard_normal((6, 3)), upper=[*q, LIMIT])
        assert_lists(all_solutions(arm, target_of(arm, q)), arm, target_of(arm, q), q)


def test_candidates_near_a_double_root_are_polished_to_one(rng):
    axes, points, _ = ARMS["UR5"]
    q = np.array([0.3, -1.0, 0.0, 0.5, 0.9, 0.4])
    for _ in range(5):
        arm = arm_of(axes, points + OFF * rng.standard_normal((6, 3)))
        listed = all_solutions(arm, target_of(arm, q)).coordinates
        assert (differences(listed, q[None]) < 1e-4).sum() == 1


POSE = Target([0.3, 0.2, 0.4], [1.0, 0.0, 0.0, 0.0])
MISUSES = {
    "no rotation": ({"target": Target([0.3, 0.2, 0.4])}, "target: expected a Target with a rot"),
    "a position": ({"target": [0.3, 0.2, 0.4]}, "target: expected a Target with a rotation"),
    "a batch": ({"target": Target(np.zeros((2, 3)), [1, 0, 0, 0])}, r"target: expected shape \(3"),
    "no unit": ({"target": Target([0.3, 0.2, 0.4], [1.0, 0.1, 0, 0])}, "rotation: expected"),
    "a skeleton": ({"robot": Skeleton([-1, 0], np.ones((2, 3)))}, "robot: expected hinges"),
    "a ball": ({"robot": Articulation(Skeleton([-1, 0], np.ones((2, 3))))}, "robot: expected hin"),
    "an unknown joint": ({"grid": {"nose": 0.0}}, "grid: expected"),
    "beyond limits": ({"grid": {0: 7.0}}, "grid: expected values from -3.14159 to 3.14159, got 7"),
    "no values": ({"grid": {0: []}}, "grid: expected values of 'joint0', got none"),
    "a fixed joint": ({"grid": {7: 0.0}}, "grid: expected hinges or slides"),
    "too few locked": ({"grid": {}}, "grid: expected joints to lock, so that 6 of 7 remain, got 0"),
}


@pytest.mark.parametrize(("changes", "message"), MISUSES.values(), ids=MISUSES)
def test_misuse_is_named(changes, message):
    arguments = {"robot": arm_of(*SEVEN), "target": POSE} | changes
    with pytest.raises(ValueError, match=f"^{message}"):
        all_solutions(**arguments)
    if arguments.pop("target") is POSE:
        with pytest.raises(ValueError, match=f"^{message}"):
            prepare_all_solutions(**arguments)


def test_misuse_of_a_search_is_named_where_a_closed_form_needs_none():
    arm = arm_of(*ARMS["UR5"][:2])
    for call in (partial(all_solutions, arm, POSE), partial(prepare_all_solutions, arm)):
        with pytest.raises(ValueError, match=r"^restarts: expected"):
            call(restarts=0)


BAD_ROWS = {
    "too few": ([0.3, 0.2, 0.4], r"target: expected shape \(7,\)"),
    "no number": ([np.nan, 0.2, 0.4, 1, 0, 0, 0], "target: expected finite"),
    "no unit": ([0.3, 0.2, 0.4, 1.0, 0.1, 0, 0], "rotation: expected"),
    "a word": ("left", "target: expected"),
}


@pytest.mark.parametrize(("row", "message"), BAD_ROWS.values(), ids=BAD_ROWS)
@pytest.mark.parametrize("geometry", [ARMS["UR5"][:2], GENERAL], ids=["closed form", "search"])
def test_misuse_of_a_prepared_robot_is_named(geometry, row, message):
    arm = arm_of(*geometry)
    solve = prepare_all_solutions(arm, restarts=4)
    for form in (row, np.array(row)):
        with pytest.raises(ValueError, match=f"^{message}"):
            solve(form)
    assert_same(solve(row_of(POSE)), all_solutions(arm, POSE, restarts=4))
