"""The end of a step to 25 digits, beside the same in 50 digits by another hand."""

import extended_precision
import numpy as np
import pytest

from plumbob.crosscheck.mass_spring import exact_step as module
from plumbob.crosscheck.mass_spring.exact_step import exact_step
from plumbob.reference import ImplicitEuler, scenes

H = 1 / 30


@pytest.fixture(params=["springs", "damped ropes"])
def swing(request):
    """A small cloth in motion, and Newton's answer to its next step."""
    system, state = scenes.lab_cloth(size=4, damping=0.5 * (request.param != "springs"))
    if request.param != "springs":
        system = system.replaced(tension_only=np.arange(len(system.springs)) % 2 == 0)
    euler = ImplicitEuler(system, h=H, tolerance=0.0, max_iterations=20)
    for _ in range(10):
        state = euler.step(state).state
    return system, state, euler.step(state).state.positions


def digits(exact):
    return extended_precision.wide(exact.positions) + extended_precision.wide(exact.remainder)


def test_it_agrees_with_fifty_digits(swing):
    system, state, x = swing
    known = extended_precision.Step(system, state, H).minimiser(x)
    exact = exact_step(system, state, H, x)
    distance = extended_precision.norm(digits(exact) - known)
    assert distance < 1e-25
    assert exact.bound < 1e-25
    assert (exact.positions == known.astype(float)).all()
    assert extended_precision.norm(extended_precision.wide(x) - known) > 1e-17  # else nothing to do


def test_the_error_of_an_answer_is_that_against_fifty_digits(swing):
    """Against Newton's own answer it would be zero."""
    system, state, x = swing
    step = extended_precision.Step(system, state, H)
    known, wide, norm = step.minimiser(x), extended_precision.wide, extended_precision.norm
    y = ImplicitEuler(system, h=H).objective(state).y
    expected = float(norm(wide(x) - known) / norm(wide(y) - known))
    assert exact_step(system, state, H, x).error(x, y) == pytest.approx(expected, rel=1e-9, abs=0)
    assert 0 < expected < 1e-11


def test_a_refinement_that_does_not_arrive_says_how_far_off_it_may_be(swing, monkeypatch):
    """No error is shown below what is known of the truth."""
    system, state, x = swing
    monkeypatch.setattr(module, "REFINEMENTS", 1)
    y = ImplicitEuler(system, h=H).objective(state).y
    exact = exact_step(system, state, H, x + 1e-3 * (y - x))
    assert exact.error(exact.positions, y) == pytest.approx(1e-3, rel=1e-3)
