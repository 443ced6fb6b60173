"""Further attempts from random poses."""

import numpy as np
import pytest

from plumbob.reference import Outcome, Target, forward_kinematics, solve_ik
from plumbob.reference.inverse_kinematics.reduce import prepare


@pytest.fixture
def arm(chain_of_joints, rng):
    """Return seven hinges with limits."""
    return chain_of_joints("hinge", rng, links=7, lower=-1.8, upper=1.8)


@pytest.fixture
def poses(arm, rng):
    """Return 30 poses that the arm can take."""
    pose = forward_kinematics(arm, arm.random(rng, 30))
    return Target(pose.positions[:, -1], pose.rotations[:, -1])


def reached(solution):
    return solution.outcome == Outcome.CONVERGED


@pytest.mark.sample(without=["damped_least_squares"])
@pytest.mark.parametrize("solver", ["levenberg_marquardt", "damped_least_squares"], indirect=True)
def test_more_restarts_reach_more_targets(arm, poses, rng, solver):
    q = arm.random(rng)
    counts = [
        np.count_nonzero(reached(solve_ik(arm, q, poses, solver, restarts=n))) for n in (0, 3, 20)
    ]
    assert counts[0] < counts[1] < counts[2] or counts == [30, 30, 30]


def test_what_one_start_reaches_soon_takes_no_restart(arm, rng, solver, backend):
    """A start near the target: the very same answer."""
    q = 0.9 * arm.random(rng)
    there = forward_kinematics(arm, q + 1e-3)
    target = Target(there.positions[-1], there.rotations[-1])
    options = {"tolerance": 2e-3, "tolerance_rotation": 2e-3, "record": True}
    one = solve_ik(arm, q, target, solver, **options)
    more = solve_ik(arm, q, target, solver, restarts=5, **options)
    if one.outcome is Outcome.CONVERGED and one.iterations < 3:
        assert (more.coordinates == one.coordinates).all()
        assert more.iterations == one.iterations
    else:
        assert solver in ("fabrik", "ccd", "jacobian_transpose")


def test_one_restart_from_the_very_answer_arrives(arm, solver, backend, rng):
    """The start is bent wrongly and given no iterations, so that only restarts count."""
    random = prepare(arm, (7,), (True,), 3, 11).restarts
    assert random.shape == (3, 8)
    there = forward_kinematics(arm, random[1])
    target = Target(there.positions[-1], there.rotations[-1])
    solution = solve_ik(arm, arm.random(rng), target, solver, restarts=3, seed=11, max_iterations=0)
    assert solution.outcome is Outcome.CONVERGED
    assert solution.iterations == 0
    np.testing.assert_allclose(solution.coordinates, random[1], rtol=0, atol=1e-15)
    other = solve_ik(arm, arm.random(rng), target, solver, restarts=3, seed=12, max_iterations=0)
    assert other.outcome is Outcome.ITERATION_LIMIT
    if solver != "levenberg_marquardt":  # whose attempts take turns
        q, options = arm.random(rng), {"seed": 11, "max_iterations": 5}
        one, more = (solve_ik(arm, q, target, solver, restarts=n, **options) for n in (0, 3))
        assert more.iterations == one.iterations  # the nearest restart comes first
        assert more.outcome is Outcome.CONVERGED


def test_restarts_follow_from_the_seed(arm, poses, rng):
    q = arm.random(rng)
    first = solve_ik(arm, q, poses, "levenberg_marquardt", restarts=5, seed=1)
    again = solve_ik(arm, q, poses, "levenberg_marquardt", restarts=5, seed=1)
    other = solve_ik(arm, q, poses, "levenberg_marquardt", restarts=5, seed=2)
    assert (first.coordinates == again.coordinates).all()
    assert (first.coordinates != other.coordinates).any()


def test_restarts_keep_limits_and_leave_other_joints(
    articulated, reachable, moving_joints, rng, solver, backend
):
    for seed in range(4):
        model = articulated(["ball", "hinge", "ball", "slide", "hinge", "ball", "hinge"], seed)
        targets, _ = reachable(model, rng, 1, oriented=0.0)
        q = model.random(rng)
        solution = solve_ik(model, q, targets, solver, restarts=3, max_iterations=3)
        assert model.within_limits(solution.coordinates, 1e-7)
        for j in set(range(7)) - moving_joints(model, targets) - set(model.mimics):
            own = model.coordinates_of(j)
            np.testing.assert_allclose(solution.coordinates[own], q[own], rtol=0, atol=1e-15)


def test_the_iterations_of_all_attempts_are_counted_and_recorded(arm, rng, solver, backend):
    far = Target([100.0, 0.0, 0.0])
    q = arm.random(rng)
    solution = solve_ik(arm, q, far, solver, restarts=2, max_iterations=4, record=True)
    assert solution.outcome.unreachable
    assert 3 <= solution.iterations <= 20
    assert solution.history.shape == (solution.iterations + 1,)
    assert np.isfinite(solution.history).all()
    assert (solution.history >= 90.0).all()
