"""The phases of Levenberg-Marquardt from one start."""

from itertools import pairwise

import numpy as np
import pytest

from plumbob.reference import (
    Articulation,
    Outcome,
    Target,
    forward_kinematics,
    prepare_ik,
    solve_ik,
    track,
)
from plumbob.reference.inverse_kinematics.reduce import FURTHER_STARTS, further_shares
from plumbob.reference.inverse_kinematics.restarts import PATIENCE_OF_PHASES

COUNT = 150


@pytest.fixture
def arm(chain_of_joints, rng):
    """Return seven hinges with limits, of which a single start often fails."""
    return chain_of_joints("hinge", rng, links=6, lower=-2.0, upper=2.0)


@pytest.fixture
def task(arm, rng):
    """Return starts, and poses that the arm can take."""
    pose = forward_kinematics(arm, arm.random(rng, COUNT))
    return arm.random(rng, COUNT), Target(pose.positions[:, -1], pose.rotations[:, -1])


def first_phase(model, start, target, solver="levenberg_marquardt", most=200):
    """Return what the first phase alone answers."""
    return solve_ik(model, start, target, solver, max_iterations=most, phases=1)


def test_phases_reach_most_of_what_the_first_does_not(arm, task):
    start, target = task
    alone = first_phase(arm, start, target).outcome == Outcome.CONVERGED
    settings = {"solver": "levenberg_marquardt", "max_iterations": 200}
    phased = solve_ik(arm, start, target, **settings).outcome == Outcome.CONVERGED
    assert alone.mean() < 0.7
    assert phased.mean() > 0.9
    assert not (alone & ~phased).any()


def test_what_the_first_phase_reaches_is_the_same_to_the_bit(arm, task):
    start, target = task
    alone = first_phase(arm, start, target)
    phased = solve_ik(arm, start, target, "levenberg_marquardt", max_iterations=200)
    early = (alone.outcome == Outcome.CONVERGED) & (alone.iterations < PATIENCE_OF_PHASES)
    assert np.count_nonzero(early) > COUNT // 10
    np.testing.assert_array_equal(phased.coordinates[early], alone.coordinates[early])
    np.testing.assert_array_equal(phased.iterations[early], alone.iterations[early])


@pytest.mark.parametrize("most", [0, 1, 49, 50, 51, 60, 75, 200])
def test_phases_keep_the_limits_and_the_number_of_iterations(arm, task, most):
    start, target = task
    phased = solve_ik(arm, start, target, "levenberg_marquardt", max_iterations=most)
    assert (phased.iterations <= most).all()
    assert arm.within_limits(phased.coordinates, 0.0).all()
    alone = first_phase(arm, start, target, most=most)
    assert np.count_nonzero(phased.outcome == Outcome.CONVERGED) >= np.count_nonzero(
        alone.outcome == Outcome.CONVERGED
    )


def test_more_phases_reach_no_fewer_targets_and_restarts_of_the_plain_method_stay_plain(arm, task):
    start, target = task
    settings = {"solver": "levenberg_marquardt", "max_iterations": 200}
    reached = [
        solve_ik(arm, start, target, **settings, phases=n).outcome == Outcome.CONVERGED
        for n in range(1, 9)
    ]
    # phases share their iterations, so that a target of one may be lost to another
    assert all(fewer.sum() <= more.sum() for fewer, more in pairwise(reached))
    assert reached[7].sum() > reached[1].sum() > reached[0].sum()
    all_phases = solve_ik(arm, start, target, **settings)
    np.testing.assert_array_equal(all_phases.outcome == Outcome.CONVERGED, reached[7])
    prepared = prepare_ik(arm, oriented=True, **settings, phases=1)
    pose = np.concatenate([target.position[0], target.rotation[0]])
    single = solve_ik(arm, start[0], Target(pose[:3], pose[3:]), **settings, phases=1)
    assert prepared(start[0], pose) == single.outcome
    np.testing.assert_array_equal(prepared.coordinates, single.coordinates)


@pytest.mark.parametrize(("solver", "phases"), [("levenberg_marquardt", 9), ("ccd", 2), (None, 0)])
def test_phases_that_no_solver_has_are_refused(arm, task, solver, phases):
    with pytest.raises(ValueError, match=f"phases: expected an integer .* got {phases}"):
        solve_ik(arm, *task, solver, phases=phases)


def test_phases_give_a_batch_the_answers_of_single_calls_and_repeat_them(arm, task):
    start, (position, Q, effector, weight) = task
    batch = solve_ik(arm, start, task[1], "levenberg_marquardt", record=True)
    again = solve_ik(arm, start, task[1], "levenberg_marquardt", seed=7)
    np.testing.assert_array_equal(batch.coordinates, again.coordinates)
    for i in range(0, COUNT, 5):
        target = Target(position[i], Q[i], effector, weight)
        single = solve_ik(arm, start[i], target, "levenberg_marquardt", record=True)
        np.testing.assert_array_equal(single.coordinates, batch.coordinates[i])
        assert single.iterations == batch.iterations[i]
        np.testing.assert_array_equal(single.history, batch.history[i, : single.iterations + 1])


def test_only_levenberg_marquardt_has_phases_and_a_track_has_none(arm, task):
    start, target = task
    for solver in ("levenberg_marquardt", "ccd", "fabrik"):
        settings = {"solver": solver, "max_iterations": 100}
        alone = first_phase(arm, start, target, solver, most=100)
        same = solve_ik(arm, start, target, **settings).coordinates == alone.coordinates
        assert same.all() == (solver != "levenberg_marquardt")
    stuck = np.flatnonzero(first_phase(arm, start, target).outcome != Outcome.CONVERGED)[:5]
    for i in stuck:
        frame = Target(target.position[i : i + 1], target.rotation[i : i + 1])
        motion = track(arm, frame, "levenberg_marquardt", start[i], max_iterations=200)
        alone = first_phase(arm, start[i : i + 1], frame)
        np.testing.assert_allclose(motion.coordinates, alone.coordinates, rtol=0, atol=1e-9)


# ---- what the phases are made of


@pytest.mark.parametrize("joints", [1, 2, 7, 30])
def test_further_starts_fill_the_middle_of_the_ranges_evenly(joints):
    shares = further_shares(joints)
    assert shares.shape == (FURTHER_STARTS, joints)
    assert (shares[0] == 0.5).all()
    assert ((shares >= 0.25) & (shares <= 0.75)).all()
    for column in shares.T:  # along no axis two are alike
        assert np.diff(np.sort(column)).min() > 1e-3


def test_the_second_phase_begins_in_the_middle_of_the_ranges(arm, task):
    """A target there is reached without another iteration, once the first phase is given up."""
    middle = 0.5 * (arm.lower + arm.upper)
    pose = forward_kinematics(arm, middle)
    target = Target(pose.positions[-1], pose.rotations[-1])
    start, _ = task
    solution = solve_ik(arm, start, target, "levenberg_marquardt", phases=2)
    given_up = (solution.coordinates == middle).all(axis=-1)
    assert np.count_nonzero(given_up) > COUNT // 10
    assert (solution.outcome[given_up] == Outcome.CONVERGED).all()
    assert (solution.iterations[given_up] >= PATIENCE_OF_PHASES).all()


def test_hinges_without_limits_turn_by_shares_of_a_circle(arm, rng):
    """The second phase begins half a circle from the start."""
    free = Articulation(arm.skeleton, "hinge", arm.axes)
    starts = free.random(rng, COUNT)
    pose = forward_kinematics(free, starts + np.pi)
    target = Target(pose.positions[:, -1], pose.rotations[:, -1])
    solution = solve_ik(free, starts, target, "levenberg_marquardt", phases=2)
    there = np.abs(solution.positions - pose.positions).max(axis=(1, 2)) < 1e-12
    assert np.count_nonzero(there) > COUNT // 10
    assert (solution.iterations[there] >= PATIENCE_OF_PHASES).all()


def test_phases_are_the_same_whatever_the_number_of_restarts(arm, task):
    """With restarts that all fail, of no iterations, the phases give the answer of one start."""
    start, target = task
    alone = solve_ik(arm, start, target, "levenberg_marquardt", max_iterations=60)
    more = solve_ik(arm, start, target, "levenberg_marquardt", max_iterations=60, restarts=4)
    reached = alone.outcome == Outcome.CONVERGED
    assert (more.outcome[reached] == Outcome.CONVERGED).all()
    assert (more.merit <= alone.merit + 1e-12)[~reached].all()
