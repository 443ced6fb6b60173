"""Errors of a step with several minima: each end is right, and nothing else is."""

import numpy as np
import pytest

from plumbob.bench.problems.step_minima import StepMinima, above_lowest
from plumbob.reference import ImplicitEuler, State, scenes

H = 0.1
SOLVERS = ("newton", "newton_cg", "lbfgs")


@pytest.fixture(scope="module")
def squeezed():
    """A step of a cloth squeezed in its plane, and its end by each solver."""
    system, state = scenes.lab_cloth(size=5, gravity=0.0)
    noise = np.random.default_rng(5).standard_normal(state.positions.shape)
    x = 0.6 * state.positions + 0.01 * noise * system.free[:, None]
    step = system, State(x, 0.0 * x)
    limits = {"h": H, "tolerance": 1e-12, "max_iterations": 2000}
    solved = [ImplicitEuler(system, solver=name, **limits).step(step[1]) for name in SOLVERS]
    return step, [result.state.positions for result in solved]


def g(system, x, y):
    """The objective of a step without loads and dampers, term by term."""
    i, j = system.springs.T
    stretch = np.linalg.norm(x[i] - x[j], axis=1) - system.rest_lengths
    inertia = system.masses @ ((x - y) ** 2).sum(axis=1)
    return 0.5 * inertia + 0.5 * H**2 * system.stiffnesses @ stretch**2


def test_each_end_is_without_error_and_g_says_which_is_lowest(squeezed):
    (system, state), ends = squeezed
    minima, y = StepMinima(system, state, H), state.positions
    measured = [minima.measure([y, 0.5 * (x + y), x]) for x in ends]
    heights = [float(errors["minimum"][-1]) for errors in measured]
    assert len(set(np.round(heights, 6))) > 1
    lowest = min(g(system, x, y) for x in (*ends, minima.newton.positions))
    for x, errors in zip(ends, measured, strict=True):
        assert errors["proven"].all()
        assert errors["error"] == pytest.approx([1.0, 0.5, 0.0], abs=1e-9)  # the tolerance is 1e-12
        expected = (g(system, x, y) - lowest) / (g(system, y, y) - lowest)
        assert above_lowest(errors["above"][-1], heights) == pytest.approx(expected, abs=1e-12)


def test_a_wrong_answer_stays_wrong_whatever_was_measured_before(squeezed):
    (system, state), ends = squeezed
    used, noise = StepMinima(system, state, H), np.random.default_rng(1).standard_normal((25, 3))
    noise *= system.free[:, None] / np.linalg.norm(noise[system.free])
    expected = [minimum.measure([x])["error"] for minimum in [used] for x in ends]
    for x in ends:
        wrong = x + 0.1 * np.linalg.norm(x - state.positions) * noise
        (error,) = used.measure([wrong])["error"]
        assert 0.05 < error < 0.5
        assert StepMinima(system, state, H).measure([wrong])["error"] == error
    assert [used.measure([x])["error"] for x in ends] == expected


def test_a_diverged_answer_has_an_infinite_error(squeezed):
    (system, state), _ = squeezed
    minima, start = StepMinima(system, state, H), state.positions
    lost = [np.full_like(start, value) for value in (np.nan, np.inf, 1e200)]
    errors = minima.measure([start, *lost])
    assert errors["error"].tolist() == [1.0, *[np.inf] * 3]
