"""What every solver promises of every mechanism: any joints, limits, effectors, poses."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from drawn_trees import TREES, drawn, with_examples
from hypothesis import example, given

from plumbob.reference import (
    IK_SOLVERS,
    Articulation,
    Mimic,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    judge_pose,
    rotation,
    solve_ik,
    solve_tasks,
)
from plumbob.reference.arguments import frozen
from plumbob.reference.backend.threads import set_num_threads
from plumbob.reference.inverse_kinematics.problem import checked_settings, checked_targets
from plumbob.reference.inverse_kinematics.reduce import prepare
from plumbob.reference.inverse_kinematics.solve import solve_checked

# Distances of a few metres over six joints, positions recomputed.
ROUNDING = 1e-13
# Each iteration may amplify rounding; those of a dozen stay far below this.
PATH = 1e-7
# A twist is known only to 1e-16 over the cosine of half the tilt.
LIMIT = 1e-7

at_both_speeds = drawn(max_examples=5)


@pytest.fixture
def problem(articulated, reachable, beyond_limits):
    """Return the function that makes a model, a start outside of its limits, and two targets."""

    def make(kinds, seed):
        model, rng = articulated(kinds, seed), np.random.default_rng(seed)
        targets, _ = reachable(model, rng, 2)
        return model, beyond_limits(model, rng), targets

    return make


def residuals(model, q, targets):
    """Return the largest distance and angle from effectors to targets, by forward kinematics."""
    pose = forward_kinematics(model, q)
    distances = [np.linalg.norm(pose.positions[t.effector] - t.position) for t in targets]
    angles = [
        rotation.angle(pose.rotations[t.effector], t.rotation)
        for t in targets
        if t.rotation is not None
    ]
    return max(distances), max(angles, default=0.0)


# ---- the same as chains


# Anderson's mixing is of positions on chains, and of coordinates on mechanisms.
@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose"])
@pytest.mark.parametrize("solver", [name for name in IK_SOLVERS if name != "anderson_ccd"])
def test_on_balls_without_limits_the_path_is_that_of_chains(skeleton, local, rng, solver, backend):
    target = forward_kinematics(skeleton, rotation.random(rng, 6)).positions[-1]
    balls = Articulation(skeleton)
    chain = solve_ik(skeleton, local, target, solver, max_iterations=40, record=True)
    general = solve_ik(
        balls, local.ravel(), target, solver, effector=-1, max_iterations=40, record=True
    )
    assert general.iterations == chain.iterations > 1
    np.testing.assert_allclose(general.history, chain.history, rtol=0, atol=1e-11)
    np.testing.assert_allclose(general.positions, chain.positions, rtol=0, atol=1e-11)
    if solver != "fabrik":  # whose chains are rotated once, after the last sweep: another twist
        angles = rotation.angle(general.local_rotations, chain.local_rotations)
        np.testing.assert_allclose(angles, 0.0, rtol=0, atol=1e-11)
    assert general.coordinates.shape == (24,)
    assert (general.coordinates.reshape(6, 4) == general.local_rotations).all()
    assert (chain.coordinates == chain.local_rotations).all()


def test_one_iteration_on_balls_rotates_them_as_it_does_a_chain_s(skeleton, local, rng, any_solver):
    """FABRIK's twist included: of each link the shortest arc."""
    target = forward_kinematics(skeleton, rotation.random(rng, 6)).positions[-1]
    chain = solve_ik(skeleton, local, target, any_solver, max_iterations=1)
    balls = Articulation(skeleton)
    general = solve_ik(balls, local.ravel(), target, any_solver, -1, max_iterations=1)
    angles = rotation.angle(general.local_rotations, chain.local_rotations)
    np.testing.assert_allclose(angles, 0.0, rtol=0, atol=1e-12)


def test_fixed_joints_are_parts_of_their_links(rng, solver, backend):
    """Every second joint of a chain fixed, or left out and its offset and frame merged by hand."""
    offsets, frames = rng.standard_normal((7, 3)), rotation.random(rng, 7)
    kinds = ["ball", "fixed", "hinge", "fixed", "ball", "fixed", "fixed"]
    whole = Articulation(Skeleton(range(-1, 6), offsets), kinds, [1.0, 2.0, 2.0], frames=frames)
    x = [offsets[j] + rotation.rotate(frames[j], offsets[j + 1]) for j in (1, 3)]
    last = offsets[5] + rotation.rotate(frames[5], offsets[6])
    R = [rotation.multiply(frames[j], frames[j + 1]) for j in (1, 3, 5)]
    merged = Articulation(
        Skeleton(range(-1, 3), [offsets[0], *x, last]),
        ["ball", "hinge", "ball", "fixed"],
        [1.0, 2.0, 2.0],
        frames=[frames[0], *R],
    )
    there = forward_kinematics(merged, merged.random(rng))
    target, q = Target(there.positions[-1], there.rotations[-1]), merged.random(rng)
    there = solve_ik(whole, q, target, solver, max_iterations=10)
    here = solve_ik(merged, q, target, solver, max_iterations=10)
    assert there.iterations == here.iterations
    np.testing.assert_allclose(there.coordinates, here.coordinates, rtol=0, atol=PATH)


# ---- what comes out


@at_both_speeds
@with_examples
@given(**TREES)
def test_the_answer_is_forward_kinematics_of_its_coordinates(problem, solver, backend, kinds, seed):
    model, q, targets = problem(kinds, seed)
    solution = solve_ik(model, q, targets, solver, max_iterations=5)
    pose = forward_kinematics(model, solution.coordinates)
    np.testing.assert_allclose(solution.positions, pose.positions, rtol=0, atol=ROUNDING)
    _, local = model.local_transforms(solution.coordinates)
    np.testing.assert_allclose(solution.local_rotations, local, rtol=0, atol=ROUNDING)
    distance, angle = residuals(model, solution.coordinates, targets)
    assert solution.residual == pytest.approx(distance, abs=ROUNDING)
    assert solution.residual_rotation == pytest.approx(angle, abs=ROUNDING)
    reached = distance <= 1e-4 and angle <= 1e-4
    assert (solution.outcome is Outcome.CONVERGED) == reached
    assert not solution.outcome.unreachable  # some pose reaches the targets


@at_both_speeds
@with_examples
@given(**TREES)
def test_limits_are_kept_and_other_joints_left_or_brought_within(
    problem, moving_joints, solver, backend, kinds, seed
):
    model, q, targets = problem(kinds, seed)
    found = solve_ik(model, q, targets, solver, max_iterations=5).coordinates
    assert model.within_limits(found, LIMIT).all()
    clamped, moving = model.clamp(q), moving_joints(model, targets)
    for j in set(range(len(kinds))) - set(model.mimics) - moving:
        own = model.coordinates_of(j)
        np.testing.assert_allclose(found[own], clamped[own], rtol=0, atol=LIMIT)


def test_solvers_judge_and_tasks_keep_the_limits_of_followers(solver):
    links = Skeleton(range(-1, 3), [[0.0, 0.0, 0.0], *[[1.0, 0.0, 0.0]] * 3])
    kinds, lower = ["hinge"] * 3 + ["fixed"], np.array([-3.0, -3.0, -0.2, 0.0])
    arm = Articulation(links, kinds, lower=lower, upper=-lower, mimics={2: Mimic(1)})
    free = Articulation(links, kinds, mimics={2: Mimic(1)})
    beyond = np.array([0.3, 1.0])
    target = Target(forward_kinematics(free, beyond).positions[-1])
    assert judge_pose(arm, beyond, target).limit_excess.max() == pytest.approx(0.8)
    solution = solve_ik(arm, [0.3, 0.9], target, solver)
    assert solution.outcome is not Outcome.CONVERGED
    for q in (solution.coordinates, solve_tasks(arm, beyond, [target], restarts=0).coordinates):
        assert np.abs(q[arm.coordinates_of(2)]).max() <= 0.2
        assert judge_pose(arm, q, target).limit_excess.max() == 0.0


@at_both_speeds
@with_examples
@given(**TREES)
def test_the_history_holds_the_distance_before_and_after_each_iteration(
    articulated, reachable, solver, backend, kinds, seed
):
    model, rng = articulated(kinds, seed), np.random.default_rng(seed)
    targets, _ = reachable(model, rng, 2)
    q = model.random(rng)
    solution = solve_ik(model, q, targets, solver, max_iterations=3, record=True)
    assert solution.history.shape == (solution.iterations + 1,)
    start, _ = residuals(model, q, targets)
    assert solution.history[0] == pytest.approx(start, abs=ROUNDING)
    one = solve_ik(model, q, targets, solver, max_iterations=1)
    if one.iterations == 1:
        assert solution.history[1] == pytest.approx(one.residual, abs=ROUNDING)
    if solution.outcome not in (Outcome.STALLED, Outcome.UNREACHABLE):
        assert solution.history[-1] == pytest.approx(solution.residual, abs=ROUNDING)


def test_both_speeds_take_the_same_path(problem, solver):
    from plumbob.reference import set_backend

    for seed in range(5):
        model, q, targets = problem(["ball", "hinge", "slide", "free", "hinge", "ball"], seed)
        fast = solve_ik(model, q, targets, solver, max_iterations=10, record=True)
        with set_backend("python"):
            plain = solve_ik(model, q, targets, solver, max_iterations=10, record=True)
        assert plain.iterations == fast.iterations
        np.testing.assert_allclose(plain.history, fast.history, rtol=0, atol=PATH)
        np.testing.assert_allclose(plain.coordinates, fast.coordinates, rtol=0, atol=PATH)


def test_a_skeleton_that_was_solved_for_is_let_go_of(local):
    chain = Skeleton(range(-1, 5), np.ones((6, 3)))
    solve_ik(chain, local, Target([1.0, 1.0, 1.0], rotation.identity()), max_iterations=1)
    gone = weakref.ref(chain)
    del chain
    gc.collect()
    assert gone() is None


# ---- batches


@pytest.fixture
def many(articulated, rng):
    """Return a model, starts (2, 1), and two targets, one of them (3,)."""
    model = articulated(["hinge", "ball", "slide", "ball", "hinge", "fixed", "ball"], 3)
    there = forward_kinematics(model, model.random(rng, 3))
    near = Target(there.positions[:, -1], there.rotations[0, -1], -1)
    return model, model.random(rng, 2, 1), [near, Target(there.positions[0, 2], effector=2)]


@pytest.mark.parametrize("restarts", [0, 1])
@pytest.mark.parametrize("on_chain", [False, True])
def test_a_batch_is_its_solves(many, on_chain, restarts, rng, solver, backend):
    model, starts, (near, *others) = many
    if on_chain:
        model, starts = model.skeleton, rotation.random(rng, 2, 1, 7)
        near, others = near._replace(rotation=None), []
    options = {"max_iterations": 6, "record": True, "restarts": restarts}
    batch = solve_ik(model, starts, [near, *others], solver, **options)
    assert batch.positions.shape == (2, 3, 7, 3)
    assert batch.coordinates.shape == (2, 3, *starts.shape[2:])
    for i in range(2):
        for j in range(3):
            target = [near._replace(position=near.position[j]), *others]
            one = solve_ik(model, starts[i, 0], target, solver, **options)
            assert (batch.coordinates[i, j] == one.coordinates).all()
            assert (batch.local_rotations[i, j] == one.local_rotations).all()
            assert batch.residual[i, j] == one.residual
            assert batch.residual_rotation[i, j] == one.residual_rotation
            assert batch.iterations[i, j] == one.iterations
            assert Outcome(batch.outcome[i, j]) is one.outcome
            assert (batch.history[i, j, : one.iterations + 1] == one.history).all()
            assert (batch.history[i, j, one.iterations :] == one.history[-1]).all()


def test_a_batch_on_all_cores_is_the_same_as_on_one(many, rng, solver):
    model, _, (near, _) = many
    starts = model.random(rng, 100)
    target = Target(near.position[0], near.rotation, -1)
    with set_num_threads(1):
        here = solve_ik(model, starts, target, solver, max_iterations=2)
    with set_num_threads(3):
        there = solve_ik(model, starts, target, solver, max_iterations=2)
    assert (here.coordinates == there.coordinates).all()
    assert (here.residual_rotation == there.residual_rotation).all()


def test_chained_each_target_starts_from_the_last_solution(many, solver, backend):
    model, starts, (near, far) = many
    settings = checked_settings(solver, 1e-4, 1e-4, 4, 0, 0, False)
    chained = replace(settings, limits=settings.limits._replace(chained=True))
    targets = checked_targets(model, [near, far], None)
    motion = solve_checked(model, starts[0, 0], targets, chained)
    q = starts[0, 0]
    for i in range(3):
        target = [near._replace(position=near.position[i]), far]
        q = solve_ik(model, q, target, solver, max_iterations=4).coordinates
        np.testing.assert_allclose(motion.coordinates[i], q, rtol=0, atol=1e-11)
    assert np.ptp(motion.coordinates, axis=0).max() > 1e-3


def test_whatever_comes_in_the_kernel_is_compiled_once(many, solver):
    model, starts, (near, far) = many
    solve_ik(model, starts[0, 0].tolist(), near._replace(position=near.position[0]), solver)
    solve_ik(model, np.repeat(starts, 2, axis=-1)[..., ::2], [near, far], solver, restarts=1)
    solve_ik(model, np.float32(model.neutral()), np.float32([1, 2, 3]), solver, 6, tolerance=1)
    one = near._replace(position=frozen(near.position[0]), rotation=frozen(near.rotation))
    solve_ik(model, frozen(starts[0, 0]), one, solver)
    assert len(IK_SOLVERS[solver].mechanism.compiled.signatures) == 1


def test_no_targets_give_no_solutions(many, solver, backend):
    model, starts, _ = many
    none = Target(np.empty((0, 3)), rotation.identity(), -1)
    solution = solve_ik(model, starts[0, 0], none, solver)
    assert solution.residual.shape == (0,)
    assert solution.coordinates.shape == (0, model.coordinate_count)
    chain = Skeleton([-1, 0], np.eye(2, 3))
    assert solve_ik(chain, rotation.identity(2), np.empty((0, 3)), solver).residual.shape == (0,)


# ---- the same world seen otherwise


def moved(model, targets, Q, shift):
    """Return the model and the targets rotated about the origin and shifted."""
    offsets, frames = model.skeleton.offsets.copy(), model.frames.copy()
    offsets[0] = shift + rotation.rotate(Q, offsets[0])
    frames[0] = rotation.multiply(Q, frames[0])
    there = Articulation(
        Skeleton(model.skeleton.parents, offsets), model.kinds, model.axes, frames=frames,
        lower=model.lower, upper=model.upper, cones=model.cones, mimics=model.mimics,
    )  # fmt: skip
    return there, [
        t._replace(
            position=shift + rotation.rotate(Q, t.position),
            rotation=None if t.rotation is None else rotation.multiply(Q, t.rotation),
        )
        for t in targets
    ]


@at_both_speeds
@with_examples
@given(**TREES)
# Arms almost collinear below a free joint: FABRIK takes the least of the best rotations.
@example(kinds=["free", "slide", "free", "fixed", "fixed", "hinge"], seed=237332365)
def test_a_moved_world_changes_nothing(problem, solver, backend, kinds, seed):
    model, q, targets = problem(kinds, seed)
    rng = np.random.default_rng(seed)
    there, targets_there = moved(model, targets, rotation.random(rng), rng.standard_normal(3))
    here = solve_ik(model, q, targets, solver, max_iterations=4, record=True)
    again = solve_ik(there, q, targets_there, solver, max_iterations=4, record=True)
    same = min(len(here.history), len(again.history))
    assert same == len(here.history) or here.outcome is not Outcome.CONVERGED
    np.testing.assert_allclose(again.history[:same], here.history[:same], rtol=0, atol=PATH)


def scaled(model, q, targets, s):
    """Return the model, coordinates and targets with all lengths s times as large."""
    factors = np.array([s if kind == "slide" else 1.0 for kind in model.kinds])
    mimics = {
        j: Mimic(m.leader, m.multiplier * factors[j] / factors[m.leader], m.shift * factors[j])
        for j, m in model.mimics.items()
    }
    large = Articulation(
        Skeleton(model.skeleton.parents, s * model.skeleton.offsets), model.kinds, model.axes,
        frames=model.frames, lower=factors * model.lower, upper=factors * model.upper,
        cones=model.cones, mimics=mimics,
    )  # fmt: skip
    return large, to_scale(model, q, s), [t._replace(position=s * t.position) for t in targets]


def to_scale(model, q, s):
    q = q.copy()
    for j in set(range(model.joint_count)) - set(model.mimics):
        if model.kinds[j] in ("slide", "free"):
            q[..., model.coordinates_of(j)][..., :3] *= s
    return q


def reach(model, targets):
    """Return the length that solvers measure by [m]: one metre where free joints leave none."""
    oriented = tuple(t.rotation is not None for t in targets)
    return prepare(model, tuple(t.effector for t in targets), oriented).mechanism.reach


@at_both_speeds
@with_examples
@given(**TREES)
def test_another_unit_of_length_changes_nothing(problem, solver, backend, kinds, seed):
    """The unit is a power of two, so that nothing is rounded otherwise."""
    model, q, targets = problem(kinds, seed)
    large, start, targets_there = scaled(model, q, targets, 1024.0)
    here = solve_ik(model, q, targets, solver, max_iterations=6)
    there = solve_ik(large, start, targets_there, solver, max_iterations=6, tolerance=1024e-4)
    if reach(large, targets) == 1024.0 * reach(model, targets):  # there is some length
        assert there.iterations == here.iterations
        expected = to_scale(model, here.coordinates, 1024.0)
        np.testing.assert_allclose(there.coordinates, expected, rtol=1e-9, atol=1e-9)
        assert there.residual_rotation == pytest.approx(here.residual_rotation, abs=1e-9)


# ---- bad input


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"local_rotations": [0, 1.1, 0, 0, 0, 0]}, "q: expected unit quaternions"),
        ({"target": Target([0, 0, 0], [1, 1, 0, 0])}, "rotation: expected unit quaternions"),
        ({"target": Target([0, 0, 0], weight=0)}, "weight: expected a number greater than 0"),
        (
            {"target": [Target([0, 0, 0], effector=2), Target([1, 0, 0], effector="joint2")]},
            "target: expected one an effector, got two for joint 2",
        ),
        (
            {"target": [Target([0, 0, 0]), [1.0, 0.0, 0.0]]},
            r"target: expected only Targets beside others, got \[1.0, 0.0, 0.0\]",
        ),
        (
            {"target": Target([0, 0, 0], effector=2), "effector": 1},
            "effector: expected that of the target, 2, got 1",
        ),
        (
            {"target": [Target(np.zeros((2, 3))), Target(np.zeros((3, 3)), effector=1)]},
            r"target: expected leading axes that broadcast .* \(2,\), got \(3,\)",
        ),
        (
            {"target": Target(np.zeros((2, 3)), np.tile([1, 0, 0, 0], (3, 1)))},
            r"target: expected leading axes that broadcast .* \(2,\), got \(3,\)",
        ),
    ],
)  # fmt: skip
def test_bad_input_is_named(change, message):
    kinds = ["hinge", "ball", "slide", "fixed"]
    arguments = {
        "skeleton": Articulation(Skeleton([-1, 0, 1, 2], np.eye(4, 3)), kinds),
        "local_rotations": np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
        "target": np.zeros(3),
        "solver": "levenberg_marquardt",
    }
    with pytest.raises(ValueError, match=message):
        solve_ik(**(arguments | change))


def test_no_solver_runs_away_where_a_slide_moves_others_along(solver):
    """FABRIK moved the leader as if it were alone, too far by half, again and again."""
    links = Skeleton([-1, 0, 1, 2], [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0.1], [0.3, 0, 0]])
    axes = [[1, 0, 0], [1, 0.1, 0], [0, 1, 0], [0, 0, 1]]
    kinds = ["slide", "slide", "hinge", "fixed"]
    lift = Articulation(links, kinds, axes, mimics={1: Mimic(0, 1.5)})
    q = np.array([0.4, 0.7])
    target = forward_kinematics(lift, q).positions[-1]
    solution = solve_ik(lift, lift.neutral(), target, solver, max_iterations=2000)
    assert solution.residual < 1e-3
