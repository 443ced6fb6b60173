"""Laws of saddle points: Newton's method tells them from minima, and says nothing wrong of rest."""

import numpy as np
import pytest

from plumbob.reference import (
    ImplicitEuler,
    MassSpring,
    Outcome,
    State,
    scenes,
)
from plumbob.reference.backend.compiled import set_backend
from plumbob.reference.implicit_euler import newton
from plumbob.reference.implicit_euler.certificate import Coverage

SEEDS = range(20)


def rod(share, particles=5, stiffness=128.0, pinned=True):
    """A straight rod along x of springs of 1 m, at rest at a share of their length, no gravity.

    Binary fractions cancel without rounding, so that the gradient is exactly zero.
    """
    springs = [[i, i + 1] for i in range(particles - 1)]
    pins = [0, particles - 1] if pinned else []
    system = MassSpring(np.ones(particles), springs, 1.0, stiffness, pinned=pins, gravity=(0, 0, 0))
    x = np.arange(particles)[:, None] * [share, 0.0, 0.0]
    return system, State(x, np.zeros_like(x))


def least_eigenvalue(integrator, state, x, **loads):
    """Return the least eigenvalue of the Hessian over the free particles [kg], dense."""
    free = np.repeat(integrator.system.free, 3)
    H = integrator.objective(state, **loads).hessian(x).toarray()
    return float(np.linalg.eigvalsh(H[np.ix_(free, free)])[0])


@pytest.mark.parametrize("start", ["y", "x_n"])
def test_a_squeezed_straight_rod_is_a_saddle_and_a_stretched_one_a_minimum(start, backend):
    for share in (0.5, 1.0, 1.5):
        expected = Outcome.SADDLE if share < 1.0 else Outcome.CONVERGED
        system, state = rod(share)
        integrator = ImplicitEuler(system, h=1.0, start=start)
        result = integrator.step(state)
        assert (result.outcome, result.iterations) == (expected, 0)
        assert result.residual == 0.0
        np.testing.assert_array_equal(result.state.positions, state.positions)
        is_minimum = expected is Outcome.CONVERGED
        assert integrator.certify(state, result).covered == is_minimum
        assert (least_eigenvalue(integrator, state, state.positions) > 0) == is_minimum


def test_a_saddle_whose_gradient_is_rounding_is_one_too(backend):
    """The particles are where Newton's gradient is as small as rounding lets it be, not zero."""
    system, state = rod(0.8, particles=6)
    result = ImplicitEuler(system, h=1.0).step(state)
    assert result.residual > 0.0
    assert (result.outcome, result.iterations) == (Outcome.SADDLE, 0)


@pytest.mark.parametrize("share", [1.0, 1.0625])
@pytest.mark.parametrize("tolerance", [1e-10, 1e-75])
def test_a_saddle_that_newton_comes_to_is_one(share, tolerance, backend):
    """A pin pushes a rod at rest, and a stretched one."""
    system, state = rod(share)
    pins = [[0.0, 0.0, 0.0], [3.5, 0.0, 0.0]]
    integrator = ImplicitEuler(system, h=1.0, tolerance=tolerance)
    result = integrator.step(state, pin_positions=pins)
    known = integrator.certify(state, result, pin_positions=pins)
    assert result.iterations > 0
    assert result.outcome is Outcome.SADDLE
    assert known.coverage is Coverage.NOT_CONVEX
    x = result.state.positions
    assert least_eigenvalue(integrator, state, x, pin_positions=pins) < 0
    assert np.abs(x[:, 1:]).max() == 0.0


@pytest.mark.parametrize("tolerance", [1e-2, 1e-6, 1e-10])
def test_newton_goes_on_from_an_indefinite_hessian_to_a_minimum(tolerance, backend):
    """A rod just off its line buckles, whatever the tolerance that it passes on its way."""
    system, state = rod(0.9, stiffness=512.0)
    rng = np.random.default_rng(4)
    for _ in range(20):
        off = np.where(system.free[:, None], 1e-3 * rng.standard_normal((5, 3)), 0.0)
        moved = State(state.positions + off, state.velocities)
        integrator = ImplicitEuler(system, h=1.0, tolerance=tolerance)
        result = integrator.step(moved)
        assert result.outcome is Outcome.CONVERGED
        assert least_eigenvalue(integrator, moved, result.state.positions) > 0


@pytest.mark.parametrize("place", [0.0, 1e3])
@pytest.mark.parametrize("stiffness", [1e3, 1e12])
def test_rounding_is_not_called_a_saddle(stiffness, place, backend):
    """At rest, in any direction, rounding squeezes springs by 1e-16: h² k / m is up to 1e15."""
    rng = np.random.default_rng(7)
    for _ in range(10):
        link = rng.standard_normal(3)
        x = place + np.arange(12)[:, None] * link
        springs = [[i, i + 1] for i in range(11)]
        length = float(np.linalg.norm(link))
        system = MassSpring(np.full(12, 1e-3), springs, length, stiffness, gravity=(0, 0, 0))
        result = ImplicitEuler(system, h=1.0, tolerance=1.0).step(State(x, np.zeros_like(x)))
        assert result.outcome.solved


def _squeezed_net(seed):
    """Return integrator and result of a net in a plane, squeezed or stretched, and the details."""
    rng = np.random.default_rng(seed)
    x = np.array([[i, j, 0.0] for i in range(4) for j in range(4)])
    springs = [[a, b] for a in range(16) for b in range(a) if np.linalg.norm(x[a] - x[b]) < 1.5]
    rest = [np.linalg.norm(x[a] - x[b]) for a, b in springs]
    system = MassSpring(
        np.ones(16), springs, rest, 10.0 ** rng.uniform(0, 3), pinned=[0, 3, 12, 15],
        gravity=(0, 0, 0),
    )  # fmt: skip
    bump = rng.choice([0.0, 1e-4]) * rng.standard_normal((16, 1)) * [0, 0, 1]
    state = State(x + np.where(system.free[:, None], bump, 0.0), np.zeros((16, 3)))
    pins = x[system.pinned] * rng.uniform(0.7, 1.2)
    integrator = ImplicitEuler(system, h=1.0, max_iterations=1000)
    return integrator, integrator.step(state, pin_positions=pins), state, pins


@pytest.mark.parametrize("seed", SEEDS)
def test_what_newton_calls_an_end_agrees_with_the_eigenvalues(seed):
    """Squeezed in its plane a net is at a saddle; just out of it, it buckles to a minimum."""
    integrator, result, state, pins = _squeezed_net(seed)
    end = result.state.positions
    least = least_eigenvalue(integrator, state, end, pin_positions=pins)
    assert result.outcome in (Outcome.CONVERGED, Outcome.SADDLE)
    assert (least < 0) == (result.outcome is Outcome.SADDLE)
    covered = integrator.certify(state, result, pin_positions=pins).covered
    assert not (covered and result.outcome is Outcome.SADDLE)


def test_ordinary_steps_factorise_once_an_iteration(monkeypatch):
    """The end of a swinging cloth's step is accepted without a further factor."""
    count, eliminate = [0], newton.factorize

    def counted(*arguments):
        count[0] += 1
        return eliminate(*arguments)

    monkeypatch.setattr(newton, "factorize", counted)
    system, state = scenes.lab_cloth(size=4, stiffness=1e4, damping=0.2, gravity=9.81)
    integrator = ImplicitEuler(system, h=1 / 60)
    for _ in range(5):
        count[0] = 0
        with set_backend("python"):
            result = integrator.step(state)
        state = result.state
        assert result.outcome is Outcome.CONVERGED
        assert result.iterations > 1
        assert count[0] == result.iterations


@pytest.mark.parametrize("solver", ["local_global", "chebyshev", "lbfgs", "newton_cg"])
@pytest.mark.parametrize(("mass", "stiffness", "step"), [(1e-6, 1e9, 1e3), (1.0, 1e75, 1e74)])
def test_masses_that_vanish_beside_the_springs_are_named(solver, mass, stiffness, step):
    springs = [[0, 1], [1, 2], [2, 3]]
    system = MassSpring(np.full(4, mass), springs, 1.0, stiffness)
    with pytest.raises(ValueError, match=r"^masses, stiffnesses, h: expected M \+ h² L") as error:
        ImplicitEuler(system, h=step, solver=solver)
    assert f"{mass:g} kg" in str(error.value)
    assert f"{stiffness * step**2:g} kg" in str(error.value)


def test_masses_that_vanish_beside_the_stiffness_end_the_search_for_a_shift(backend):
    """The compressed spring needs more than 1e308 times the masses."""
    system = MassSpring([1e-75, 1e-75], [[0, 1]], 1e75, 1e75, gravity=(0, 0, 0))
    state = State([[0, 0, 0], [1e-140, 0, 0]], np.zeros((2, 3)))
    result = ImplicitEuler(system, h=1.0).step(state)
    assert result.outcome is Outcome.STALLED
    np.testing.assert_array_equal(result.state.positions, state.positions)
