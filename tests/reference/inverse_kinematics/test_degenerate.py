"""Always an answer: places where directions vanish, limits close, and nothing can move."""

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from plumbob.reference import (
    IK_SOLVERS,
    Articulation,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    solve_ik,
)
from plumbob.reference.articulation import KINDS

shared = settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])

# A target on a straight chain's line is reached within few hundred iterations by all but FABRIK on
# hinges, whose rotations are bound to axes that the backward positions know nothing of.
ITERATIONS = 500


def model_of(skeleton, kind, axes=(0.0, 0.0, 1.0)):
    """Return joints of a kind, or the skeleton itself, and the coordinates of zero."""
    if kind == "skeleton":
        return skeleton, rotation.identity(skeleton.joint_count)
    model = Articulation(skeleton, kind, axes)
    return model, model.zero()


DIRECTIONS = [np.array([1.0, 0.0, 0.0]), np.array([0.6, 0.48, 0.64])]


@pytest.mark.sample(every=3)
@pytest.mark.parametrize("direction", DIRECTIONS, ids=["axis", "oblique"])
@pytest.mark.parametrize("kind", ["skeleton", "ball", "hinge"])
@pytest.mark.parametrize("height", [-3.0, -0.3, 0.0, 2.0, 3.8])
def test_a_straight_chain_is_freed_from_a_target_on_its_own_line(direction, kind, height, solver):
    """Four links of a metre; hinges rotate about an axis across them."""
    if solver == "fabrik" and kind == "hinge":
        return
    chain = Skeleton(range(-1, 4), np.outer([0.0] + [1.0] * 4, direction))
    model, q = model_of(chain, kind, np.cross(direction, [0.0, 0.3, 1.0]))
    options = {"tolerance": 1e-3, "max_iterations": ITERATIONS}
    solution = solve_ik(model, q, Target(height * direction), solver, **options)
    assert solution.outcome is Outcome.CONVERGED
    again = solve_ik(model, q, Target(height * direction), solver, **options)
    assert (again.coordinates == solution.coordinates).all()


def test_a_hinge_at_its_limit_is_bent_oppositely(solver, backend):
    """The target is straight behind, pi away in the one direction that the limits leave."""
    arm = Articulation(
        Skeleton([-1, 0], [[0, 0, 0], [1.0, 0, 0]]), ["hinge", "fixed"], lower=-3.2, upper=0.0
    )
    solution = solve_ik(arm, [0.0], [-1.0, 0.0, 0.0], solver, max_iterations=300)
    assert solution.outcome is Outcome.CONVERGED
    assert solution.coordinates[0] == pytest.approx(-np.pi, abs=1e-3)


def test_a_stuck_start_is_not_given_up_for_something_worse(solver, backend):
    """A limit keeps the hinge from its target; bent away from it, one iteration may not return."""
    arm = Articulation(
        Skeleton([-1, 0], [[0, 0, 0], [1.0, 0, 0]]), ["hinge", "fixed"], lower=-3.0, upper=0.5
    )
    target = [np.cos(1.2), np.sin(1.2), 0.0]
    for iterations in (1, 3, 100):
        solution = solve_ik(arm, [0.5], target, solver, max_iterations=iterations)
        assert solution.coordinates[0] == pytest.approx(0.5, abs=1e-9)
        assert solution.outcome is Outcome.STALLED


@pytest.mark.sample(every=3)
@pytest.mark.parametrize("where", ["root", "effector", "reach", "beyond"])
@pytest.mark.parametrize("kind", ["ball", "hinge", "slide", "free"])
@pytest.mark.parametrize("oriented", [False, True])
def test_special_targets_are_answered(where, kind, oriented, solver, chain_of_joints, rng):
    model = chain_of_joints(kind, rng, links=3)
    q = model.random(rng)
    pose = forward_kinematics(model, q)
    reach = model.skeleton.reach()
    x = {
        "root": pose.positions[0],
        "effector": pose.positions[-1],
        "reach": pose.positions[0] + reach * np.array([0.6, 0.0, 0.8]),
        "beyond": pose.positions[0] + 2.0 * reach * np.array([0.6, 0.0, 0.8]),
    }[where]
    target = Target(x, pose.rotations[-1] if oriented else None)
    solution = solve_ik(model, q, target, solver, max_iterations=50, record=True)
    assert np.isfinite(solution.coordinates).all()
    assert np.isfinite(solution.history).all()
    if where == "effector":
        assert (solution.outcome, solution.iterations) == (Outcome.CONVERGED, 0)
    if where == "beyond" and kind in ("ball", "hinge"):
        assert solution.outcome.unreachable
        assert solution.residual >= reach * (1.0 - 1e-12)


def test_without_freedom_the_start_is_the_answer(solver, backend):
    statue = Articulation(Skeleton([-1, 0], [[1.0, 0, 0], [0, 1.0, 0]]), "fixed")
    at = solve_ik(statue, [], [1.0, 1.0, 0.0], solver)
    assert (at.outcome, at.iterations, at.residual) == (Outcome.CONVERGED, 0, 0.0)
    off = solve_ik(statue, np.empty((2, 0)), Target([1.0, 1.0, 3.0]), solver, restarts=2)
    assert (off.outcome == Outcome.UNREACHABLE).all()
    assert (off.residual == 3.0).all()
    assert off.coordinates.shape == (2, 0)
    rotated = Target([1.0, 1.0, 0.0], rotation.exponential([0.5, 0, 0]))
    wrong = solve_ik(statue, [], rotated, solver, restarts=1)
    assert wrong.outcome is Outcome.STALLED
    assert wrong.residual_rotation == pytest.approx(0.5, abs=1e-15)


@pytest.mark.parametrize("kind", ["skeleton", "hinge", "ball"])
def test_the_root_as_effector_can_rotate_but_not_move(kind, solver, backend):
    model, q = model_of(Skeleton([-1, 0], [[1.0, 0, 0], [0, 1.0, 0]]), kind)
    off = solve_ik(model, q, [1.0, 3.0, 4.0], solver, effector=0)
    assert (off.residual, off.iterations, off.outcome) == (5.0, 0, Outcome.UNREACHABLE)
    Q = rotation.exponential([0.0, 0.0, 0.7])
    for target in (Target([1.0, 0, 0], effector=0), Target([1.0, 0, 0], Q, 0)):
        there = solve_ik(model, q, target, solver, max_iterations=300)
        assert there.outcome is Outcome.CONVERGED


def test_limits_without_width_hold_fast(solver, backend, rng, beyond_limits):
    model = Articulation(
        Skeleton(range(-1, 4), rng.standard_normal((5, 3))),
        ["hinge", "ball", "slide", "hinge", "fixed"],
        lower=[0.3, 0.2, -0.1, -2.0, 0],
        upper=[0.3, 0.2, -0.1, 2.0, 0],
        cones=0.0,
    )
    there = forward_kinematics(model, model.clamp(model.random(rng)))
    q = beyond_limits(model, rng)
    solution = solve_ik(model, q, there.positions[-1], solver, max_iterations=200)
    twist = rotation.exponential([0.0, 0.0, 0.2])
    np.testing.assert_allclose(solution.coordinates[:1], [0.3], rtol=0, atol=1e-15)
    assert rotation.angle(solution.coordinates[1:5], twist) < 1e-12
    np.testing.assert_allclose(solution.coordinates[5:6], [-0.1], rtol=0, atol=1e-15)
    if solver != "jacobian_transpose":  # whose step length counts what the ball cannot do
        assert solution.outcome is Outcome.CONVERGED  # by the one hinge that can move


@pytest.mark.parametrize("kind", ["skeleton", "ball", "hinge"])
def test_tolerance_zero_ends(kind, solver, chain_of_joints, rng):
    model = chain_of_joints("ball" if kind == "skeleton" else kind, rng)
    poses, q = model.random(rng, 20), model.random(rng)
    if kind == "skeleton":
        model, poses, q = model.skeleton, poses.reshape(20, -1, 4), q.reshape(-1, 4)
    targets = forward_kinematics(model, poses).positions[:, -1]
    solution = solve_ik(model, q, targets, solver, tolerance=0.0, max_iterations=300)
    limit = solution.outcome == Outcome.ITERATION_LIMIT
    assert (solution.iterations[limit] >= 300).all()
    reached = solution.outcome == Outcome.CONVERGED
    assert (reached == (solution.residual == 0.0)).all()
    if solver == "levenberg_marquardt" and kind != "hinge":
        assert solution.residual.max() < 1e-13
        assert not limit.any()
        assert (solution.outcome[~reached] == Outcome.STALLED).all()
        assert not reached.all()


def test_what_only_rounding_keeps_from_its_target_is_stalled(rng):
    """Some arrive where fixed joints are merged, and are a rounding off where they are not."""
    model = Articulation(
        Skeleton(range(-1, 6), rng.standard_normal((7, 3))),
        ["hinge", "fixed", "hinge", "fixed", "ball", "fixed", "fixed"],
        [0.3, 0.4, 1.2],
        frames=rotation.random(rng, 7),
    )
    targets = forward_kinematics(model, model.random(rng, 300)).positions[:, -1]
    solution = solve_ik(model, model.random(rng), targets, "levenberg_marquardt", tolerance=4e-16)
    soon = solution.iterations < 100
    assert soon.sum() > 150
    off = soon & (solution.residual > 4e-16)
    assert off.any()
    assert (solution.outcome[off] == Outcome.STALLED).all()


# ---- anything at all

# Lengths below 1e-75 but 0 are refused.
coordinate = st.sampled_from([0.0, 0.5, 1.0, -1.0, 2.0]) | st.floats(-3.0, 3.0).map(
    lambda x: x if abs(x) > 1e-70 else 0.0
)
point = st.lists(coordinate, min_size=3, max_size=3)
quaternion = point.map(rotation.exponential)
wanted = st.tuples(
    point,
    st.none() | quaternion,
    st.integers(-5, 4),
    st.sampled_from([1.0, 1e-75, 1e75, 1e-6, 7.0]),
)


@st.composite
def trees(draw):
    """Return a tree of joints, many offsets zero or in line, with limits that may have no width."""
    count = draw(st.integers(1, 5))
    parents = [-1] + [draw(st.integers(0, j - 1)) for j in range(1, count)]
    offsets = draw(st.lists(point, min_size=count, max_size=count))
    kinds = draw(st.lists(st.sampled_from(KINDS), min_size=count, max_size=count))
    axis = draw(point.filter(lambda v: np.linalg.norm(v) > 0.1))
    low = draw(st.sampled_from([-np.inf, -1.0, 0.0]))
    high = draw(st.sampled_from([np.inf, 1.0, 0.0]))
    return Articulation(
        Skeleton(parents, offsets), kinds, axis, lower=low, upper=high,
        cones=draw(st.sampled_from([np.inf, 0.5, 0.0])),
    )  # fmt: skip


ANYTHING = {
    "model": trees(),
    "asked": st.lists(wanted, min_size=1, max_size=3),
    "solver": st.sampled_from(["ccd", "fabrik", "levenberg_marquardt"]),
    "tolerance": st.sampled_from([0.0, 1e-9, 1e-3]),
    "seed": st.integers(0, 100),
    "restarts": st.integers(0, 1),
}


@shared
@given(**ANYTHING)
@example(
    model=Articulation(Skeleton([-1, 0], np.zeros((2, 3)))), asked=[([0, 0, 0], None, 1, 1.0)],
    solver="levenberg_marquardt", tolerance=0.0, seed=0, restarts=0,
)  # fmt: skip
def test_there_is_always_an_answer_and_it_is_true(model, asked, solver, tolerance, seed, restarts):
    answer_is_true(model, asked, solver, tolerance, seed, restarts)


@pytest.mark.slow
@settings(max_examples=5000)
@given(**(ANYTHING | {"solver": st.sampled_from(list(IK_SOLVERS))}))
def test_there_is_always_an_answer_in_many_more_places(
    model, asked, solver, tolerance, seed, restarts
):
    answer_is_true(model, asked, solver, tolerance, seed, restarts)


def answer_is_true(model, asked, solver, tolerance, seed, restarts):
    """Assert that an answer is finite, within its limits, and says what forward kinematics says."""
    targets = {}
    for position, R, joint, weight in asked:
        targets[joint % model.joint_count] = Target(position, R, joint % model.joint_count, weight)
    solution = solve_ik(
        model, model.random(np.random.default_rng(seed)), list(targets.values()), solver,
        tolerance=tolerance, tolerance_rotation=tolerance, max_iterations=15, restarts=restarts,
        record=True,
    )  # fmt: skip
    pose = forward_kinematics(model, solution.coordinates)
    distances = [np.linalg.norm(pose.positions[t.effector] - t.position) for t in targets.values()]
    assert solution.residual == pytest.approx(max(distances), abs=1e-12)
    assert np.isfinite(solution.history).all()
    assert solution.iterations <= 15 * (2 * restarts + 1)
    assert model.within_limits(solution.coordinates, 1e-7)
    reached = solution.residual <= tolerance and solution.residual_rotation <= tolerance
    assert (solution.outcome is Outcome.CONVERGED) == reached
    if solution.outcome is Outcome.ITERATION_LIMIT:
        assert solution.iterations >= 15
    if solution.outcome.unreachable:
        assert solution.residual > tolerance
