"""The Jacobian methods on mechanisms: rows, steps, and steps that limits hold."""

import numpy as np
import pytest
from drawn_trees import TREES, drawn, with_examples
from hypothesis import given
from scipy.optimize import lsq_linear

from plumbob.reference import (
    Articulation,
    Outcome,
    Skeleton,
    Target,
    forward_kinematics,
    rotation,
    solve_ik,
)
from plumbob.reference.inverse_kinematics.bounded_step import (
    damped_step,
    linearise_task,
    transposed_step,
)
from plumbob.reference.inverse_kinematics.jacobian import FIXED_DAMPING
from plumbob.reference.inverse_kinematics.levenberg_marquardt import (
    DAMPING_OF_POSES,
    DAMPING_OF_POSITIONS,
)
from plumbob.reference.inverse_kinematics.mechanism import LEVER
from plumbob.reference.jacobians import integrate, jacobian

# A dozen products and sums of numbers of order one to ten.
ROUNDING = 1e-12
# The damped matrix has a condition of at most a few thousand here.
SOLVED = 1e-9

at_both_speeds = drawn(max_examples=10)


@pytest.fixture
def problem(articulated, reachable, unlimited):
    """Return the function that makes a model without limits, a start and two targets."""

    def make(kinds, seed):
        model, rng = unlimited(articulated(kinds, seed)), np.random.default_rng(seed)
        targets, _ = reachable(model, rng, 2)
        return model, model.random(rng), targets

    return make


def worth_of_freedoms(model, reach):
    """Return what a unit of each freedom stands for: 1 rad, or the reach [m]."""
    scale = np.ones(model.freedom_count)
    for j, kind in enumerate(model.kinds):
        if j not in model.mimics and kind in ("slide", "free"):
            scale[model.freedoms_of(j)][:3] = reach
    return scale


def stacked(model, q, targets, reach):
    """Return e (equation,) and J (equation, freedom) of all targets, by `jacobians.jacobian`."""
    pose, errors, rows = forward_kinematics(model, q), [], []
    for position, Q, joint, weight in targets:
        root, J = np.sqrt(weight), jacobian(model, q, joint)
        errors.append(root * (position - pose.positions[joint]))
        rows.append(root * J[:3])
        if Q is not None:
            wrong = rotation.multiply(Q, rotation.conjugate(pose.rotations[joint]))
            errors.append(root * LEVER * reach * rotation.logarithm(wrong))
            rows.append(root * LEVER * reach * J[3:])
    return np.concatenate(errors), np.concatenate(rows) * worth_of_freedoms(model, reach)


def freedoms_of_moving(model, joints):
    """Return the freedoms of some joints, in their order."""
    return np.concatenate([np.r_[model.freedoms_of(j)] for j in sorted(joints)] + [[]]).astype(int)


@at_both_speeds
@with_examples
@given(**TREES)
def test_errors_and_rows_are_those_of_the_jacobians(problem, machine, moving_joints, kinds, seed):
    model, q, targets = problem(kinds, seed)
    mechanism, target, data, workspace = machine(model, q, targets)
    linearise_task(mechanism, target, data, workspace.system)
    e, J = stacked(model, q, targets, mechanism.reach)
    own = freedoms_of_moving(model, moving_joints(model, targets))
    np.testing.assert_allclose(workspace.system.e, e, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(workspace.system.J, J[:, own].T, rtol=0, atol=ROUNDING)
    others = np.setdiff1d(np.arange(model.freedom_count), own)
    assert not J[:, others].any()  # whoever is left out moves no effector


def damped(J, e, damping):
    return J.T @ np.linalg.solve(J @ J.T + damping * np.eye(len(e)), e)


def sugihara(J, e, targets, reach):
    poses = any(target.rotation is not None for target in targets)
    return damped(J, e, (DAMPING_OF_POSES if poses else DAMPING_OF_POSITIONS) * e @ e)


def transposed(J, e, targets, reach):
    g = J.T @ e
    move = J @ g
    return g * (e @ move) / (move @ move) if g.any() else g


STEPS = {
    "levenberg_marquardt": sugihara,
    "damped_least_squares": lambda J, e, targets, reach: damped(J, e, FIXED_DAMPING * reach**2),
    "jacobian_transpose": transposed,
}


@pytest.mark.parametrize("any_solver", STEPS, indirect=True)
@at_both_speeds
@with_examples
@given(**TREES)
def test_one_iteration_is_the_textbook_s(problem, machine, any_solver, kinds, seed):
    model, q, targets = problem(kinds, seed)
    targets = [target._replace(weight=target.weight / 2.0) for target in targets]
    reach = machine(model, q, targets).mechanism.reach
    heaviest = max(target.weight for target in targets)
    shares = [target._replace(weight=target.weight / heaviest) for target in targets]
    e, J = stacked(model, q, shares, reach)
    if not J.any():
        return
    step = worth_of_freedoms(model, reach) * STEPS[any_solver](J, e, targets, reach)
    solution = solve_ik(
        model, q, targets, any_solver, tolerance=0.0, tolerance_rotation=0.0, max_iterations=1
    )
    if solution.iterations == 1:  # else nothing moves, or it is bent and asked again
        arrived = forward_kinematics(model, integrate(model, q, step))
        np.testing.assert_allclose(solution.positions, arrived.positions, rtol=0, atol=SOLVED)


# ---- limits


def limited(rng, machine, chain_of_joints, targets=1):
    """Return hinges whose limits are near, slides among them, and a far target."""
    model = chain_of_joints("hinge", rng, links=5)
    kinds = np.where(rng.random(6) < 0.7, "hinge", "slide")
    q = rng.uniform(-1.0, 1.0, 6)
    model = Articulation(
        model.skeleton, list(kinds), model.axes,
        lower=q - rng.uniform(0.0, 0.3, 6), upper=q + rng.uniform(0.0, 0.3, 6),
    )  # fmt: skip
    target = forward_kinematics(model, q + rng.standard_normal(6))
    wanted = [Target(target.positions[j], effector=j) for j in (5, 3)[:targets]]
    return model, q, wanted, machine(model, q, wanted)


def bounds(model, q, reach):
    scale = worth_of_freedoms(model, reach)[: len(q)]
    return (model.lower[: len(q)] - q) / scale, (model.upper[: len(q)] - q) / scale


def test_a_held_step_is_the_least_squares_solution_within_the_limits(rng, machine, chain_of_joints):
    active = 0
    for _ in range(60):
        model, _, _, (mechanism, target, data, workspace) = limited(rng, machine, chain_of_joints)
        own = data.q.copy()
        linearise_task(mechanism, target, data, workspace.system)
        J, e = workspace.system.J.T.copy(), workspace.system.e.copy()
        damping = 0.1 * mechanism.reach**2
        damped_step(mechanism, data, workspace.system, damping)
        lower, upper = bounds(model, own, mechanism.reach)
        system = np.vstack([J, np.sqrt(damping) * np.eye(len(own))])
        wanted = np.concatenate([e, np.zeros(len(own))])
        best = lsq_linear(system, wanted, (lower, upper + 1e-15), tol=1e-14)
        step = workspace.system.step
        assert (step >= lower - ROUNDING).all()
        assert (step <= upper + ROUNDING).all()
        cost = 0.5 * np.sum((system @ step - wanted) ** 2)
        assert cost == pytest.approx(best.cost, rel=1e-9)
        active += np.count_nonzero(workspace.system.active)
    assert active > 100


def test_a_transposed_step_leaves_out_what_limits_stop(rng, machine, chain_of_joints):
    for _ in range(20):
        _, _, _, (mechanism, target, data, workspace) = limited(rng, machine, chain_of_joints)
        joints = mechanism.joints
        data.q[:] = np.where(rng.random(len(data.q)) < 0.5, joints["lower"], joints["upper"])
        linearise_task(mechanism, target, data, workspace.system)
        J, e = workspace.system.J.T.copy(), workspace.system.e.copy()
        transposed_step(mechanism, data, workspace.system)
        g = J.T @ e
        free = np.where(data.q == joints["lower"], g > 0.0, g < 0.0)
        expected = np.zeros(len(g))
        expected[free] = transposed(J[:, free], e, None, None)
        np.testing.assert_allclose(workspace.system.step, expected, rtol=0, atol=ROUNDING)


@pytest.mark.sample(without=["damped_least_squares", "jacobian_transpose"])
@pytest.mark.parametrize("solver", STEPS)
def test_a_hinge_that_covers_the_circle_goes_round_where_it_must(solver, backend):
    """From near its upper limit the smaller angle to the target leads beyond it."""
    arm = Articulation(
        Skeleton([-1, 0], [[0, 0, 0], [1.0, 0, 0]]), ["hinge", "fixed"], lower=-4.0, upper=4.0
    )
    q = 4.0 + 0.3 - 2.0 * np.pi
    target = [np.cos(q), np.sin(q), 0.0]
    solution = solve_ik(arm, [3.9], target, solver, max_iterations=200)
    assert solution.outcome is Outcome.CONVERGED
    assert solution.coordinates[0] == pytest.approx(q, abs=1e-3)


# ---- equations without a solution of their own


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_arms_that_move_in_a_plane_reach_what_lies_in_it_exactly(rng, size, backend):
    """J J' is singular, and the damping falls below rounding with the error."""
    for _ in range(10):
        axis = rotation.rotate(rotation.random(rng), [0.0, 0.0, 1.0])
        across = np.cross(axis, [0.6, 0.0, 0.8])
        offsets = size * np.outer([0, 1, 1, 1], across / np.linalg.norm(across))
        arm = Articulation(Skeleton(range(-1, 3), offsets), ["hinge"] * 3 + ["fixed"], axis)
        target = forward_kinematics(arm, rng.uniform(-1.0, 1.0, 3))
        solution = solve_ik(
            arm, [0.3, 0.2, 0.1], target.positions[-1], "levenberg_marquardt", tolerance=0.0
        )
        assert solution.residual <= 1e-14 * size
