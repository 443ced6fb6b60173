"""Laws of judging anyone's step: what residuals do not see is seen, and nothing more is claimed."""

import itertools
import math

import numpy as np
import pytest

from plumbob.reference import (
    STEP_SOLVERS,
    Coverage,
    ImplicitEuler,
    Outcome,
    State,
    judge_step,
    scenes,
)
from plumbob.reference.mass_spring import MassSpring

h = 1 / 30
FLOAT32 = float(np.finfo(np.float32).eps)


def swing(stiffness):
    """A 5 x 5 cloth after three steps from rest under full gravity."""
    system, state = scenes.lab_cloth(size=5, stiffness=stiffness, damping=0.2, gravity=9.81)
    integrator = ImplicitEuler(system, h=h)
    for _ in range(3):
        state = integrator.step(state).state
    return system, state


@pytest.fixture(scope="module")
def soft():
    return swing(1e3)


@pytest.fixture(scope="module")
def stiff():
    return swing(1e6)


def local_global(system, state, iterations):
    return ImplicitEuler(
        system, h=h, solver="local_global", tolerance=0, max_iterations=iterations
    ).step(state)


def test_the_converged_step_is_the_minimiser_to_rounding_and_proven_so(soft, stiff):
    for system, state in (soft, stiff):
        end = ImplicitEuler(system, h=h).step(state).state
        found = judge_step(system, state, h, end.positions, end.velocities)
        assert found.error < 1e-9  # the tolerance is 1e-10
        assert (found.pin_displacement, found.velocity_error) == (0.0, 0.0)
        assert found.certificate.covered
        assert found.same_minimiser is True
        assert found.outcome is Outcome.AT_ROUNDING
        assert found.distance == pytest.approx(found.error * found.displacement)


def test_pins_half_a_metre_off_are_detected_where_the_residual_is_zero(soft, stiff):
    for system, state in (soft, stiff):
        targets = state.positions[system.pinned] + [0.0, 0.5, 0.0]
        astray = ImplicitEuler(system, h=h, tolerance=1e-11).step(state, pin_positions=targets)
        found = judge_step(system, state, h, astray.state.positions)
        assert found.residual < 1e-9  # below 1e-11 of |grad g(y)| as it is with these pins
        assert found.pin_displacement == pytest.approx(0.5, abs=1e-15)
        assert found.error > 1
        assert found.summary.startswith("A pin is 0.5 m from where the step takes it.")
        in_place = np.where(system.free[:, None], astray.state.positions, state.positions)
        expected = ImplicitEuler(system, h=h).certify(state, in_place)  # of the free particles
        assert found.certificate == expected
        assert expected.coverage != Coverage.PINS_ASTRAY
        taken = judge_step(system, state, h, astray.state.positions, pin_positions=targets)
        assert taken.pin_displacement == 0
        assert taken.error < 1e-9


def test_the_initial_state_of_a_stiff_cloth_has_a_large_error_but_a_small_residual(stiff):
    system, state = stiff
    nothing = judge_step(system, state, h, state.positions)
    assert nothing.residual < 0.05
    assert nothing.error > 1
    slow = judge_step(system, state, h, local_global(system, state, 20_000).state.positions)
    assert 0.01 < slow.error < 0.1
    assert slow.residual < 1e-3


def test_the_step_rounded_to_single_precision_scores_at_its_rounding(soft, stiff):
    for system, state in (soft, stiff):
        x = ImplicitEuler(system, h=h).step(state).state.positions
        found = judge_step(system, state, h, x.astype(np.float32))
        rounded = np.linalg.norm(x - x.astype(np.float32))
        assert 0 < rounded < FLOAT32 * np.linalg.norm(x)
        assert found.distance == pytest.approx(rounded, rel=1e-4)
        assert found.certificate.covered
        assert found.certificate.distance < 1.1 * rounded
        assert found.same_minimiser is True


def test_velocities_are_compared_with_their_positions(soft):
    system, state = soft
    end = ImplicitEuler(system, h=h).step(state).state
    old = judge_step(system, state, h, end.positions, state.velocities)
    expected = np.linalg.norm(state.velocities - end.velocities, axis=1).max()
    assert old.velocity_error == pytest.approx(expected, rel=1e-12)
    assert old.velocity_error > 0.1
    assert judge_step(system, state, h, end.positions).velocity_error is None


@pytest.fixture
def buckled():
    """A compressed mass between two pins, which buckles up or down."""
    pins = [[-0.5, 0, 0], [0.5, 0, 0], [0, 0, -2], [0, 0, 2]]
    system = MassSpring(
        np.ones(5), [[0, 1], [0, 2], [0, 3], [0, 4]], [1, 1, 0.5, 0.5], [100, 100, 60, 60],
        pinned=[1, 2, 3, 4], gravity=(0, 0, 0),
    )  # fmt: skip
    return lambda height: (system, State([[0, height, 0], *pins], np.zeros((5, 3))))


def newton_from(system, state, x):
    """What Newton's method comes to when it begins at x instead of y."""
    objective = ImplicitEuler(system, h=1.0).objective(state)
    objective.start = objective.evaluate(x)
    iterates = STEP_SOLVERS["newton"](system, 1.0).iterates(objective)
    return next(itertools.islice(iterates, 50, None)).positions


def test_an_answer_is_measured_against_the_nearest_minimiser(buckled):
    """Above and below the pins a minimiser is right; g and the summary tell them apart."""
    system, state = buckled(0.1)
    ends = [newton_from(system, state, state.positions * [1, sign, 1]) for sign in (1, -4)]
    assert ends[0][0, 1] > 0.1 > -0.1 > ends[1][0, 1]
    above, below = (judge_step(system, state, 1.0, x) for x in ends)
    for found in (above, below):
        assert found.error < 1e-14
        assert found.reference_certificate.covered
        assert found.certificate.distance < 1e-9
    assert (above.is_from_y, above.same_minimiser) == (True, True)
    assert (below.is_from_y, below.same_minimiser) == (False, False)
    assert "another minimiser than from y, as right as that one" in below.summary
    objective = ImplicitEuler(system, h=1.0).objective(state)
    low, high, start = map(objective.value, (*ends, state.positions))
    assert below.excess == pytest.approx((high - low) / (start - low), rel=1e-9)
    assert above.excess == pytest.approx(0.0, abs=1e-15)
    beside = judge_step(system, state, 1.0, ends[1] + 0.1 * (state.positions - ends[1]))
    assert beside.error == pytest.approx(0.1)


def test_a_saddle_that_newton_comes_to_is_not_called_a_minimiser(buckled):
    """y is one, and its gradient is zero. The limit from another answer is still proven."""
    system, state = buckled(0.0)
    saddle = judge_step(system, state, 1.0, state.positions)
    assert not saddle.reference_certificate.covered
    assert saddle.outcome is Outcome.SADDLE
    assert saddle.error == math.inf
    assert "found no minimiser to compare with (SADDLE)" in saddle.summary
    found = judge_step(system, state, 1.0, newton_from(system, state, buckled(0.1)[1].positions))
    assert found.error < 1e-14
    assert found.certificate.covered
    assert found.same_minimiser is None
    assert "Proven: a minimiser lies within" in found.summary


def test_a_minimiser_that_cannot_be_proven_is_called_so():
    """A rope between slack and taut, where the Hessian jumps."""
    system = MassSpring(
        [1, 1], [[0, 1]], 1.0, 9.0, pinned=[0], gravity=(0, 0, 0), tension_only=True
    )
    found = judge_step(system, State(np.eye(3)[:2] * [0, 1, 0], np.zeros((2, 3))), h, np.eye(3)[:2])
    assert found.outcome.solved
    assert "not proven to be a minimiser" in found.summary


def test_at_rest_only_the_rest_itself_is_without_error():
    system, state = scenes.hanging_rope(particles=4, gravity=0.0)
    assert judge_step(system, state, h, state.positions).error == 0
    assert judge_step(system, state, h, state.positions + 1e-6).error == math.inf


def test_a_limit_beyond_all_numbers_is_no_minimiser():
    """The force moves the particle by 1e82 m."""
    system, force = MassSpring([1.0], [], 1.0, 1.0), np.full((1, 3), 1e70)
    state = State(np.zeros((1, 3)), np.zeros((1, 3)))
    found = judge_step(system, state, 1e6, state.positions, external_forces=force)
    assert (found.outcome, found.error) == (Outcome.DIVERGED, math.inf)
