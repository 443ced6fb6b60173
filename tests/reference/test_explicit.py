"""Laws of the explicit integrators."""

import numpy as np
import pytest

from plumbob.reference.backend import compiled
from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.mass_spring import MassSpring, State, forces

INTEGRATORS = [symplectic_euler, runge_kutta]


def oscillator(stiffness=4.0, mass=1.0, damping=0.0):
    """Return a mass on a spring along x, pinned at the origin, stretched by 0.5 m and at rest."""
    system = MassSpring(
        [1.0, mass], [[0, 1]], 1.0, stiffness, damping, pinned=[0], gravity=(0, 0, 0)
    )
    return system, State([[0, 0, 0], [1.5, 0, 0]], np.zeros((2, 3)))


def run(integrator, system, state, h, steps):
    for _ in range(steps):
        state = integrator(system, state, h)
    return state


def observed_orders(integrator, system, state, exact, time, counts):
    """Return the slopes between the errors in position at doubled step counts."""
    ends = [run(integrator, system, state, time / n, n).positions[1, 0] for n in counts]
    errors = np.abs(np.array(ends) - exact)
    return np.log2(errors[:-1] / errors[1:])


def test_symplectic_euler_moves_with_the_new_velocity(network, backend):
    system, state = network
    h, free = 0.01, system.free
    after = symplectic_euler(system, state, h)
    v = state.velocities + h * forces(system, state) / system.masses[:, None]
    np.testing.assert_allclose(after.velocities[free], v[free], rtol=1e-15, atol=1e-15)
    np.testing.assert_array_equal(
        after.positions[free], (state.positions + h * after.velocities)[free]
    )


@pytest.mark.parametrize(
    ("integrator", "order", "counts"),
    [(symplectic_euler, 1, (200, 400, 800)), (runge_kutta, 4, (80, 160, 320))],
)
@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_observed_order(integrator, order, counts, damping):
    """x = 1 + 0.5 exp(-b t) (cos w t + b/w sin w t), with b = c/2m and w² = k/m - b²."""
    system, state = oscillator(damping=damping)
    time, b = 1.3, damping / 2
    w = np.sqrt(4.0 - b * b)
    swing = np.cos(w * time) + b / w * np.sin(w * time)
    exact = 1.0 + 0.5 * np.exp(-b * time) * swing
    orders = observed_orders(integrator, system, state, exact, time, counts)
    # The next term of the error bends the slope by a few h w; a wrong order would be off by 1.
    np.testing.assert_allclose(orders, order, rtol=0, atol=0.15)


def test_symplectic_euler_keeps_its_shadow_energy():
    """v²/2 + w² x²/2 - h w² x v/2 is what it conserves for a linear spring."""
    system, state = oscillator()
    h, w2 = 0.3, 4.0

    def shadow(state):
        x, v = state.positions[1, 0] - 1.0, state.velocities[1, 0]
        return v * v / 2 + w2 * x * x / 2 - h * w2 * x * v / 2

    after = run(symplectic_euler, system, state, h, 1000)
    assert after.velocities[1, 0] != 0
    # Rounding walks: the square root of 1000 steps of a few units in the last place.
    assert shadow(after) == pytest.approx(shadow(state), rel=1e-13, abs=0)


@pytest.mark.parametrize("integrator", INTEGRATORS)
class TestEveryIntegrator:
    def test_momentum_changes_only_by_external_forces(
        self, network, altered, rng, backend, integrator
    ):
        system, state = altered(network[0], pinned=()), network[1]
        h, outer = 0.01, rng.standard_normal((7, 3))
        after = integrator(system, state, h, outer)
        mass = system.masses[:, None]
        gained = np.sum(mass * (after.velocities - state.velocities), axis=0)
        expected = h * np.sum(mass * system.gravity + outer, axis=0)
        assert np.abs(after.velocities - state.velocities).max() > 0.1
        # Each velocity rounds to a unit in the last place, 1e-16 of about 3 m/s.
        np.testing.assert_allclose(gained, expected, rtol=0, atol=1e-14)

    def test_pins_hold_exactly(self, network, backend, integrator):
        system, state = network
        after = integrator(system, state, 0.01)
        np.testing.assert_array_equal(after.positions[2], state.positions[2])
        np.testing.assert_array_equal(after.velocities[2], np.zeros(3))
        assert np.abs(after.positions - state.positions).max() > 0.01

    def test_both_speeds_round_alike(self, network, integrator):
        ends = []
        for backend in compiled.BACKENDS:
            with compiled.set_backend(backend):
                ends.append(run(integrator, *network, 0.01, 3))
        np.testing.assert_array_equal(ends[0].positions, ends[1].positions)
        np.testing.assert_array_equal(ends[0].velocities, ends[1].velocities)

    def test_an_unstable_step_ends_in_an_error_not_in_nan(self, integrator):
        system, state = oscillator(stiffness=1e6)
        with pytest.raises(FloatingPointError, match=f"^{integrator.__name__}: .*h is too large"):
            run(integrator, system, state, 1.0, 200)


@pytest.mark.parametrize("integrate", [symplectic_euler, runge_kutta])
def test_a_step_beyond_the_largest_magnitude_is_an_error(integrate):
    """No state holds what `State` would refuse."""
    system = MassSpring([1.0], [], 1.0, 1.0, gravity=(0, -1e70, 0))
    with pytest.raises(FloatingPointError, match=r"numbers up to 1e\+75"):
        integrate(system, State([[0, 0, 0]], [[0, 0, 0]]), 1e6)
