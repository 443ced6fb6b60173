"""Laws of pinned particles that a step takes somewhere."""

import numpy as np
import pytest

from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.implicit_euler import STEP_SOLVERS, ImplicitEuler
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
    damping_matrix,
    derivation,
    forces,
    lengths,
)

h = 0.02
DISPLACEMENT = np.array([0.3, -0.1, 0.2])


def implicit(name):
    """Return a step of two iterations by the named solver: what holds then holds at the end."""

    def step(system, state, h, external_forces=None, pin_positions=None):
        integrator = ImplicitEuler(system, h=h, solver=name, tolerance=0, max_iterations=2)
        return integrator.step(state, external_forces, pin_positions).state

    return step


STEPS = {name: implicit(name) for name in STEP_SOLVERS} | {
    "symplectic_euler": symplectic_euler,
    "runge_kutta": runge_kutta,
}


@pytest.fixture(params=STEPS)
def step(request):
    return STEPS[request.param]


@pytest.fixture
def hung(network, altered):
    """The network with two pins, and where they are to go."""
    system = altered(network[0], pinned=[5, 2])
    return system, network[1], network[1].positions[[2, 5]] + [DISPLACEMENT, -2 * DISPLACEMENT]


def test_pins_end_with_their_displacement_over_h(hung, step, backend):
    system, state, pins_at = hung
    after = step(system, state, h, None, pins_at)
    np.testing.assert_array_equal(after.positions[[2, 5]], pins_at)
    expected = (pins_at - state.positions[[2, 5]]) / h
    np.testing.assert_allclose(after.velocities[[2, 5]], expected, rtol=1e-15)


def test_a_world_that_moves_evenly_is_like_one_at_rest(hung, rng, step, backend):
    """Galileo's principle, with dampers, with pins that move with the frame."""
    system, state, pins_at = hung
    drift, pull = np.array([2.0, 1.0, -3.0]), rng.standard_normal((7, 3))
    at_rest = step(system, state, h, pull, pins_at)
    moving = State(state.positions, state.velocities + drift)
    after = step(system, moving, h, pull, pins_at + h * drift)
    # Velocities of implicit steps are differences of positions, 1e-16 of 1 m, over h.
    np.testing.assert_allclose(after.positions, at_rest.positions + h * drift, rtol=0, atol=1e-13)
    np.testing.assert_allclose(after.velocities, at_rest.velocities + drift, rtol=0, atol=1e-11)


@pytest.mark.parametrize("limit", [0, 1000], ids=["factor", "conjugate gradients"])
def test_gauss_newton_linearises_where_the_pins_start(hung, rng, backend, limit):
    """M (v' - v) = h (f(x_n) - C v' - h K v') at the free particles, v' at the pins given."""
    system, state, pins_at = hung
    pull, free = rng.standard_normal((7, 3)), system.free
    i, j = system.springs.T
    u = (state.positions[i] - state.positions[j]) / lengths(system, state.positions)[:, None]
    J = np.einsum("ps,sc->spc", derivation(system).A.toarray(), u).reshape(-1, 21)
    slack = system.tension_only & (lengths(system, state.positions) < system.rest_lengths)
    K = J.T @ (np.where(slack, 0, system.stiffnesses)[:, None] * J)
    C = damping_matrix(system, state.positions).toarray()
    matrix = np.diag(np.repeat(system.masses, 3)) + h * C + h * h * K
    resting = State(state.positions, np.zeros((7, 3)))
    right = np.repeat(system.masses, 3) * state.velocities.ravel()
    right += h * forces(system, resting, pull).ravel()
    expected = np.zeros((7, 3))
    expected[~free] = (pins_at - state.positions[~free]) / h
    rows, given = np.repeat(free, 3), expected.ravel()
    right -= matrix @ given
    expected[free] = np.linalg.solve(matrix[np.ix_(rows, rows)], right[rows]).reshape(-1, 3)
    integrator = ImplicitEuler(system, h=h, solver="gauss_newton")
    integrator._solver._iteration_limit = limit
    after = integrator.step(state, pull, pins_at).state
    # Positions of about 1 m round to 1e-16, and velocities are differences of them over h.
    np.testing.assert_allclose(after.velocities, expected, rtol=0, atol=1e-12)


def test_a_system_that_is_all_pins_goes_where_it_is_taken(step, backend):
    system = MassSpring([1.0, 0.0], [[0, 1]], 1.0, 1.0, pinned=[0, 1])
    pins_at = 2 * np.eye(3)[:2]
    after = step(system, State(np.eye(3)[:2], np.ones((2, 3))), h, None, pins_at)
    np.testing.assert_array_equal(after.positions, pins_at)
