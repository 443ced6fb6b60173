"""Laws of the explicit integrators."""

import signal
import threading

import numpy as np
import pytest

from plumbob.reference import explicit
from plumbob.reference.backend import compiled
from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
    forces,
    incidence,
    kinetic_energy,
    potential_energy,
)

INTEGRATORS = [symplectic_euler, runge_kutta]


def oscillator(stiffness=4.0, mass=1.0, damping=0.0):
    """Return a mass on a spring along x, pinned at the origin, stretched by 0.5 m and at rest."""
    system = MassSpring(
        [1.0, mass], [[0, 1]], 1.0, stiffness, damping, pinned=[0], gravity=(0, 0, 0)
    )
    return system, State([[0, 0, 0], [1.5, 0, 0]], np.zeros((2, 3)))


def run(integrator, system, state, h, steps, *arguments):
    for _ in range(steps):
        state = integrator(system, state, h, *arguments)
    return state


def written_out(integrator, system, state, h, external, pin_velocities):
    """Return the state after a step as in a textbook, from `forces`."""
    free = system.free[:, None]
    x, v = state.positions, np.where(free, state.velocities, 0.0)
    v[system.pinned] = pin_velocities

    def rates(x, v):
        return v, np.where(free, forces_of(x, v), 0.0)

    def forces_of(x, v):
        # `forces` takes pins to be at rest: a damper at a moving pin is added by hand.
        total = forces(system, State(x, v), external)
        for (i, j), c in zip(system.springs, system.dampings, strict=True):
            length = np.linalg.norm(x[i] - x[j])
            u = (x[i] - x[j]) / length if length > 0 else np.array([1.0, 0.0, 0.0])
            still = np.where(free, v, 0.0)
            change = c * ((v - still)[i] - (v - still)[j]) @ u * u
            total[i] -= change
            total[j] += change
        return total / system.masses[:, None]

    if integrator is symplectic_euler:
        v = v + h * rates(x, v)[1]
        return State(x + h * v, v)
    k1 = rates(x, v)
    k2 = rates(x + h / 2 * k1[0], v + h / 2 * k1[1])
    k3 = rates(x + h / 2 * k2[0], v + h / 2 * k2[1])
    k4 = rates(x + h * k3[0], v + h * k3[1])
    dx, dv = (h / 6 * (a + 2 * b + 2 * c + d) for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return State(x + dx, v + dv)


@pytest.fixture(params=["springs", "ropes", "undamped", "coincident"])
def net(request, rng):
    """Nineteen springs among eight particles, two of them pinned: two vectors and three more."""
    pairs = rng.permutation([(i, j) for i in range(8) for j in range(i)])[:19]
    ropes, damped = request.param in ("ropes", "coincident"), request.param != "undamped"
    system = MassSpring(
        rng.uniform(1, 2, 8), pairs, rng.uniform(0.5, 2.0, 19), rng.uniform(20, 40, 19),
        rng.uniform(0.1, 0.5, 19) * damped, [2, 5], tension_only=rng.random(19) < 0.5 * ropes,
    )  # fmt: skip
    x = rng.standard_normal((8, 3))
    if request.param == "coincident":
        x[pairs[3, 0]] = x[pairs[3, 1]]
    return system, State(x, rng.standard_normal((8, 3)))


def assert_same_bits_at_both_speeds(integrator, system, state):
    ends = []
    for backend in compiled.BACKENDS:
        with compiled.set_backend(backend):
            ends.append(integrator(system, state, 0.01, steps=3))
    np.testing.assert_array_equal(ends[0].positions, ends[1].positions)
    np.testing.assert_array_equal(ends[0].velocities, ends[1].velocities)


@pytest.mark.parametrize("integrator", INTEGRATORS)
class TestEveryIntegrator:
    def test_eight_springs_at_once_pull_as_by_themselves(self, net, integrator, backend):
        """A step by `forces`, which takes the springs one by one."""
        system, state = net
        end = integrator(*net, 0.02)
        still = np.where(system.free[:, None], state.velocities, 0.0)
        expected = written_out(integrator, system, State(state.positions, still), 0.02, None, 0.0)
        np.testing.assert_allclose(end.positions, expected.positions, rtol=0, atol=1e-14)
        np.testing.assert_allclose(end.velocities, expected.velocities, rtol=0, atol=1e-12)

    def test_both_speeds_round_eight_springs_alike(self, net, integrator):
        assert_same_bits_at_both_speeds(integrator, *net)

    def test_both_speeds_round_alike(self, network, integrator):
        assert_same_bits_at_both_speeds(integrator, *network)

    def test_a_step_is_that_of_the_textbook(self, network, integrator, backend, rng):
        """With dampers, ropes, loads and a pin that moves 0.2 m."""
        system, state = network
        h, external = 0.03, rng.standard_normal(state.positions.shape)
        pins = state.positions[system.pinned] + [0.0, 0.2, 0.0]
        end = integrator(system, state, h, external, pins)
        velocities = (pins - state.positions[system.pinned]) / h
        expected = written_out(integrator, system, state, h, external, velocities)
        np.testing.assert_allclose(end.positions, expected.positions, rtol=0, atol=1e-14)
        np.testing.assert_allclose(end.velocities, expected.velocities, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(end.positions[system.pinned], pins)

    def test_many_steps_are_as_many_calls(self, network, integrator, backend, rng):
        """The same bits, unless pins move: each call rounds their places anew."""
        system, state = network
        external = rng.standard_normal(state.positions.shape)
        together = integrator(system, state, 0.01, external, steps=5)
        apart = run(integrator, system, state, 0.01, 5, external)
        np.testing.assert_array_equal(together.positions, apart.positions)
        np.testing.assert_array_equal(together.velocities, apart.velocities)

    def test_pins_move_evenly_through_all_steps(self, network, integrator):
        system, state = network
        start = state.positions[system.pinned]
        together = integrator(system, state, 0.01, None, start + 0.5, steps=5)
        apart = state
        for k in range(5):
            apart = integrator(system, apart, 0.01, None, start + 0.1 * (k + 1))
        np.testing.assert_array_equal(together.positions[system.pinned], start + 0.5)
        np.testing.assert_allclose(together.positions, apart.positions, rtol=0, atol=1e-13)
        np.testing.assert_allclose(together.velocities[system.pinned], 10.0, rtol=1e-13)

    def test_momentum_changes_by_the_loads_alone(self, integrator, rng):
        """Free particles under springs and dampers; their sum of momenta sees no spring."""
        system = MassSpring(
            rng.uniform(1, 2, 5), [[0, 1], [1, 2], [2, 3], [3, 4], [0, 4]], 0.5, 30.0, 0.4,
            tension_only=[False, True, False, True, False],
        )  # fmt: skip
        state = State(rng.standard_normal((5, 3)), rng.standard_normal((5, 3)))
        loads = rng.standard_normal((5, 3))
        end = integrator(system, state, 0.01, loads, steps=50)
        gain = system.masses @ (end.velocities - state.velocities)
        expected = 0.5 * (loads.sum(axis=0) + system.masses.sum() * system.gravity)
        np.testing.assert_allclose(gain, expected, rtol=0, atol=1e-12)

    def test_the_error_falls_at_the_order(self, integrator):
        """The oscillator's exact motion is 1 + 0.5 cos(2 t)."""
        system, state = oscillator()
        errors = [
            abs(
                integrator(system, state, 1.0 / n, steps=n).positions[1, 0]
                - (1 + 0.5 * np.cos(2.0))
            )
            for n in (100, 200)
        ]
        order = {symplectic_euler: 1, runge_kutta: 4}[integrator]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)

    @pytest.mark.parametrize("steps", [0, -1, 2.5, "two", None])
    def test_steps_are_a_positive_number(self, integrator, steps):
        with pytest.raises(ValueError, match=r"^steps: expected"):
            integrator(*oscillator(), 0.1, steps=steps)

    def test_an_unstable_step_ends_in_an_error_not_in_nan(self, integrator):
        system, state = oscillator(stiffness=1e6)
        message = f"^{integrator.__name__}: .*h is too large"
        with pytest.raises(FloatingPointError, match=message):
            run(integrator, system, state, 1.0, 200)
        with pytest.raises(FloatingPointError, match=message):
            integrator(system, state, 1.0, steps=200)


@pytest.mark.parametrize("damping", [0.0, 1.0, 30.0])
def test_as_many_steps_as_said_are_stable_and_few_are_not(network, damping):
    """Springs of no rest length are linear: the step's matrix has no eigenvalue beyond 1."""
    system = network[0].replaced(
        rest_lengths=np.zeros(len(network[0].springs)),
        dampings=np.full(len(network[0].springs), damping),
        stiffnesses=500.0 * np.ones(len(network[0].springs)),
    )
    free, A = system.free, incidence(system).toarray()
    L = A @ A.T / system.masses[:, None]
    L = L[np.ix_(free, free)]

    def largest(steps):
        h, one = 1.0 / steps, np.eye(len(L))
        v = np.hstack([-h * 500.0 * L, one - h * damping * L])
        return abs(np.linalg.eigvals(np.vstack([np.hstack([one, 0 * one]) + h * v, v]))).max()

    steps = explicit.stable_steps(system, 1.0)
    assert largest(steps) <= 1.0 + 1e-9
    assert largest(steps / 2.5) > 1.0


def test_symplectic_euler_keeps_the_energy_over_ten_thousand_steps():
    """Its energy oscillates by about h ω / 2, here 1 %, and does not drift."""
    system, state = oscillator()
    energies = []
    for _ in range(10):
        state = symplectic_euler(system, state, 0.01, steps=1000)
        energies.append(kinetic_energy(system, state) + potential_energy(system, state.positions))
    np.testing.assert_allclose(energies, 0.5, rtol=0.011)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_signal_interrupts_many_steps(integrator, monkeypatch):
    """They are made in several calls of a kernel, with the same bits as in one."""
    system, state = oscillator()
    whole = integrator(system, state, 0.01, steps=100)
    monkeypatch.setattr(explicit, "WORK", 21)
    parts = integrator(system, state, 0.01, steps=100)
    np.testing.assert_array_equal(parts.positions, whole.positions)
    np.testing.assert_array_equal(parts.velocities, whole.velocities)
    threading.Timer(0.05, signal.raise_signal, [signal.SIGINT]).start()
    with pytest.raises(KeyboardInterrupt):
        integrator(system, state, 0.01, steps=10**15)
