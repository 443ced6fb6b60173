"""What happens at a limit, in one frame of many, to one certificate of two: the rarer branches."""

import numpy as np
import pytest

from plumbob.reference import (
    Articulation,
    Mimic,
    Skeleton,
)
from plumbob.reference.implicit_euler.certificate import Certificate, Coverage
from plumbob.reference.inverse_kinematics.box_step import activate_limits, take_step
from plumbob.reference.inverse_kinematics.mechanism import new_data
from plumbob.reference.inverse_kinematics.reduce import prepare
from plumbob.reference.inverse_kinematics.restarts import (
    COST,
    GIVEN_UP,
    LIMIT,
    SPARE_ROWS,
    STALLED,
    STATE,
    WAIT,
    Limits,
    most_promising,
)
from plumbob.reference.inverse_kinematics.solve_mechanism import mechanism_criteria, new_workspace

# ---- limits


@pytest.mark.parametrize(("followed", "end"), [(False, 4.2 - 2.0 * np.pi), (True, 4.0)])
def test_a_hinge_that_another_follows_stops_at_its_limit_though_it_covers_the_circle(followed, end):
    """A revolution less would rotate the follower by half of one."""
    chain = Skeleton(range(-1, 2), np.eye(3))
    mimics = {1: Mimic(0, 0.5)} if followed else {}
    arm = Articulation(chain, ["hinge", "hinge", "fixed"], lower=-4.0, upper=4.0, mimics=mimics)
    mechanism = prepare(arm, (2,), (False,)).mechanism
    for step, expected in ((0.3, end), (-7.8, -3.9)):
        data, system = new_data(mechanism), new_workspace(mechanism).system
        data.q[:], system.step[:], system.J[:], system.e[:] = 0.0, 0.0, 1.0, 0.0
        system.active[:] = 0.0
        data.q[0], system.step[0] = 3.9, step
        assert activate_limits(mechanism, data, system) is (followed and step > 0.0)
        take_step(mechanism, data, system)
        assert data.q[0] == pytest.approx(expected, abs=1e-14)


# ---- restarts


def test_of_attempts_given_up_the_least_patient_goes_on_and_then_the_nearest():
    progress = np.zeros((5 + SPARE_ROWS, LIMIT + 1))
    progress[:, STATE] = GIVEN_UP
    progress[3, STATE] = STALLED
    progress[:5, WAIT] = 12.0, 3.0, 3.0, 3.0, 3.0
    progress[:5, COST] = 0.1, 0.5, 0.3, 0.2, 0.4
    order = []
    while (k := most_promising(progress)) >= 0:
        order.append(k)
        progress[k, STATE] = STALLED
    assert order == [2, 4, 1, 0]


@pytest.mark.parametrize(("least", "iterations"), [(0.0, 7), (1e-3, 7), (1.1e-3, 3)])
def test_a_target_further_out_than_the_tolerance_has_iterations_of_its_own(least, iterations):
    arm = Articulation(Skeleton([-1, 0], np.eye(2, 3)), ["hinge", "fixed"])
    mechanism = prepare(arm, (1,), (False,)).mechanism
    criteria = mechanism_criteria(mechanism, least, Limits(1e-3, 1e-3, 7, 3, 0, False, 8))
    assert criteria.max_iterations == iterations
    assert least < criteria.distance <= least + 1e-3


# ---- certificates and judgements


@pytest.mark.parametrize("swapped", [False, True])
def test_one_result_s_minimiser_within_the_other_s_ball_is_the_same(swapped):
    """The certificate of a poor result says little; that of the good one beside it is enough."""
    poor = Certificate(1.0, Coverage.COVERED, distance=0.9, unique_within=1.0)
    good = Certificate(1e-9, Coverage.COVERED, distance=0.05, unique_within=0.06)
    one, other = (good, poor) if swapped else (poor, good)
    assert one.shares_minimiser(other, 0.94) is True  # 0.94 + 0.05 is within 1.0
    assert one.shares_minimiser(other, 0.949) is True
    assert one.shares_minimiser(other, 0.951) is False  # further apart than 0.9 + 0.05
    assert one.shares_minimiser(good, 0.02) is (None if one is good else True)


@pytest.mark.parametrize(("distance", "shared"), [(0.049, True), (0.075, None), (0.101, False)])
def test_two_good_results_differ_only_if_their_balls_are_apart(distance, shared):
    one, other = (
        Certificate(0.0, Coverage.COVERED, distance=radius, unique_within=0.08)
        for radius in (0.03, 0.07)
    )
    assert one.shares_minimiser(other, distance) is shared
    assert other.shares_minimiser(one, distance) is shared
