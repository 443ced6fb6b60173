"""Laws of linearised steps by conjugate gradients and by a factor, and of the choice of either."""

import numpy as np
import pytest
import scipy.sparse

from plumbob.reference import scenes
from plumbob.reference.backend.compiled import Kernel, set_backend
from plumbob.reference.implicit_euler import ImplicitEuler, gauss_newton
from plumbob.reference.implicit_euler.conjugate_gradients import (
    TOLERANCE,
    cg_workspace,
    iteration_bound,
    iteration_limit,
    linearised_step,
)
from plumbob.reference.implicit_euler.factor_cache import hessian_factor
from plumbob.reference.mass_spring import MassSpring, State, lengths
from plumbob.reference.outcome import Outcome
from plumbob.reference.sparse import CholeskyFactor

pytestmark = pytest.mark.both_backends

h, MANY = 0.02, 10_000
_linearised_step = Kernel(linearised_step, relaxed=True)


def solve_linearised(x, gradient, terms, limit):
    """Return the solution and whether it converged."""
    workspace, step = cg_workspace(len(x), len(terms[3])), np.empty(x.shape)
    roots = terms[0] * np.sqrt(terms[4][1])
    converged = _linearised_step((x, gradient), terms, roots, limit, workspace, step)
    return -step, converged


def integrators(system, step=h, **settings):
    """Return the integrator by conjugate gradients alone, and by a factor alone."""
    iterative, direct = (
        ImplicitEuler(system, h=step, solver="gauss_newton", **settings) for _ in range(2)
    )
    iterative._solver.limit_products(MANY)
    direct._solver.limit_products(0)
    return iterative, direct


def cloth(size=4, scale=1.0, **settings):
    """Return a cloth in full swing, its springs stretched and compressed."""
    system, state = scenes.lab_cloth(size=size, **settings)
    noise, v = np.random.default_rng(1).standard_normal((2, *state.positions.shape))
    return system, State(scale * state.positions + 0.1 * noise, v)


def ropes():
    """Return damped ropes, most of them slack."""
    system, state = cloth(scale=0.9, damping=0.5)
    assert 0.5 < (lengths(system, state.positions) < system.rest_lengths).mean() < 1.0
    return system.replaced(tension_only=np.ones(len(system.springs), dtype=bool)), state


def oddities():
    """Return a pin without mass, coincident ends, two springs between the same particles, a spring
    without rest length and a particle without springs."""
    springs = [[0, 1], [1, 2], [2, 3], [3, 2], [3, 4]]
    r, k = [1.0, 1.0, 0.5, 0.4, 0.0], [50.0, 90.0, 20.0, 80.0, 70.0]
    system = MassSpring([0.0, 1.0, 2.0, 1.0, 3.0, 1.0], springs, r, k, pinned=[0])
    x = np.random.default_rng(2).standard_normal((2, 6, 3))
    x[0, 2] = x[0, 1]
    return system, State(*x)


SYSTEMS = {
    "cloth": cloth,
    "stiff damped cloth": lambda: cloth(stiffness=1e4, damping=1.0),
    "ropes": ropes,
    "oddities": oddities,
}


@pytest.fixture(params=SYSTEMS)
def problem(request):
    return SYSTEMS[request.param]()


def assert_equal_results(result, expected):
    """Minimisers and histories to rounding; outcomes and iterations exactly.

    The matrices' condition numbers are below 300, and EPS times 300 is 7e-14.
    """
    assert (result.outcome, result.iterations) == (expected.outcome, expected.iterations)
    pairs = [
        (getattr(side, name) for side in (result, expected)) for name in ("history", "objectives")
    ]
    pairs += [(side.state.positions for side in (result, expected))]
    for actual, desired in pairs:
        np.testing.assert_allclose(actual, desired, rtol=0, atol=1e-13 * np.abs(desired).max())


@pytest.mark.parametrize("iterations", [1, 3])
def test_both_methods_give_the_same_step(problem, iterations, backend, rng):
    """With forces and with pins that move."""
    system, state = problem
    forces = rng.standard_normal(state.positions.shape)
    pins = state.positions[system.pinned] + [0.1, -0.05, 0.02]
    both = integrators(system, max_iterations=iterations)
    result, expected = (integrator.step(state, forces, pins) for integrator in both)
    assert expected.iterations > 0
    assert_equal_results(result, expected)


def test_momentum_changes_by_the_impulse_of_the_forces(backend, rng):
    """The springs cancel but for the residual, which is a few rounding errors."""
    system, state = cloth()
    m = rng.uniform(0.5, 2.0, system.particle_count)
    free = MassSpring(m, system.springs, system.rest_lengths, 300.0, dampings=0.1)
    forces = rng.standard_normal(state.positions.shape)
    after = integrators(free)[0].step(state, forces).state
    impulse = h * (forces.sum(axis=0) + m.sum() * free.gravity)
    # Velocities are differences of positions of 1 m, known to 1e-16 m, over h.
    np.testing.assert_allclose(m @ (after.velocities - state.velocities), impulse, atol=1e-12)


def kernel_arguments(system, state):
    """Return the arguments of the kernel but the limit, for the start of a step."""
    objective = ImplicitEuler(system, h=h, solver="gauss_newton").objective(state)
    return state.positions, objective.start.gradient, objective.terms


def scaled_spectrum(system, state):
    """Return the eigenvalues of the matrix scaled by the factors of its diagonal blocks, dense."""
    objective = ImplicitEuler(system, h=h).objective(state)
    H = objective.hessian(state.positions, geometric=False).toarray()
    blocks = H.reshape(len(H) // 3, 3, len(H) // 3, 3)
    free = np.flatnonzero(system.free)
    inverses = {i: np.linalg.inv(np.linalg.cholesky(blocks[i, :, i])) for i in free}
    scaled = [[inverses[i] @ blocks[i, :, j] @ inverses[j].T for j in free] for i in free]
    return np.linalg.eigvalsh(np.block(scaled))


def test_the_bound_of_the_iterations_follows_from_the_eigenvalues(problem, backend):
    """They lie in [smallest m / (m + h² sum of k), 2]; the kernel stays within the bound."""
    system, state = problem
    k = h * h * (system.stiffnesses + system.dampings / h)
    sums = sum(np.bincount(ends, k, system.particle_count) for ends in system.springs.T)
    lowest = (system.masses / (system.masses + sums))[system.free].min()
    spectrum = scaled_spectrum(system, state)
    assert lowest * (1 - 1e-12) <= spectrum[0]
    assert spectrum[-1] <= 2 * (1 + 1e-12)
    root, bound = np.sqrt(2 / lowest), iteration_bound(system, h)
    assert bound == pytest.approx(0.5 * root * np.log(2 * root / TOLERANCE))
    arguments = kernel_arguments(system, state)
    assert solve_linearised(*arguments, int(np.ceil(bound)))[1]
    assert not solve_linearised(*arguments, int(bound / 8))[1]


def limit_of(system, step):
    return iteration_limit(system, step, hessian_factor(system))


@pytest.mark.parametrize("size", [3, 5])
def test_on_both_sides_of_the_rule_steps_are_the_same(size, backend):
    system, state = cloth(size=size)
    below, above = 1e-3, 10.0
    while above - below > 1e-14 * above:
        middle = 0.5 * (below + above)
        below, above = (middle, above) if limit_of(system, middle) else (below, middle)
    sides = [ImplicitEuler(system, h=step, solver="gauss_newton") for step in (below, above)]
    assert [side._solver.product_limit > 0 for side in sides] == [True, False]
    assert_equal_results(*(side.step(state) for side in sides))


def test_the_rule_compares_products_with_a_factorisation():
    """12 multiplications a spring and iteration, and L's columns squared with 2000 an unknown."""
    columns = np.arange(48.0, 0, -1)
    dense = CholeskyFactor(scipy.sparse.csc_array(np.eye(48) + np.ones((48, 48))))
    assert dense.multiplications == pytest.approx((columns**2).sum(), rel=0.05)
    system, _ = cloth()
    direct = hessian_factor(system).multiplications + 2000 * 48
    for step, chosen in ((0.01, True), (0.3, False)):
        bound = iteration_bound(system, step)
        assert (12 * len(system.springs) * bound <= direct) == chosen
        assert limit_of(system, step) == chosen * np.ceil(bound)
    assert iteration_bound(system, 1e160) == np.inf
    assert limit_of(system, 1e160) == 0


def test_the_factor_is_made_only_without_convergence(monkeypatch):
    """Counted in the interpreter."""
    system, state = cloth()
    integrator, (_, direct) = ImplicitEuler(system, h=h, solver="gauss_newton"), integrators(system)
    counts, eliminate = [0], gauss_newton.factorize

    def counted(*arguments):
        counts[-1] += 1
        return eliminate(*arguments)

    monkeypatch.setattr(gauss_newton, "factorize", counted)
    with set_backend("python"):
        expected = direct.step(state).state.positions
        counts.append(0)
        result = integrator.step(state).state.positions
        counts.append(0)
        integrator._solver.limit_products(3)
        fallback = integrator.step(state).state.positions
    assert counts == [1, 0, 1]  # products for nothing in the last
    assert np.abs(result - expected).max() < 1e-14
    np.testing.assert_array_equal(fallback, expected)


def test_squares_beyond_the_floats_are_left_to_the_factor(backend):
    (x, gradient, terms), scales = kernel_arguments(*oddities()), (1e-150, 1e-105, 1e105, 1e150)
    for scale in (0.0, 1e-170, 1e160):
        assert not solve_linearised(x, scale * gradient, terms, MANY)[1]
    bound = 40  # as for ordinary gradients
    expected, *others = (solve_linearised(x, s * gradient, terms, bound) for s in (1, *scales))
    for scale, (solution, converged) in zip(scales, others, strict=True):
        assert converged
        np.testing.assert_allclose(solution, scale * expected[0], rtol=1e-12)


def test_masses_that_vanish_beside_the_stiffness_stall_the_step(backend):
    """Their matrix is singular to rounding; the rule leaves it to the factor."""
    system = MassSpring([1e-30, 1e-30], [[0, 1]], 1.0, 1e10, gravity=np.zeros(3))
    state = State([[0.0, 0, 0], [1.5, 0, 0]], np.zeros((2, 3)))
    result = ImplicitEuler(system, h=h, solver="gauss_newton", max_iterations=5).step(state)
    assert (result.outcome, result.iterations) == (Outcome.STALLED, 1)


@pytest.mark.parametrize("mass", [1e-5, 1e-75])
def test_an_overflow_ends_as_by_a_factor(mass, backend):
    system = MassSpring([mass, mass], [[0, 1]], 1.0, mass)
    state = State(np.eye(3)[:2], np.zeros((2, 3)))
    for integrator in integrators(system, 1.0, max_iterations=3):
        result = integrator.step(state, 1e75 * np.eye(3)[:2])
        assert (result.outcome, result.iterations) == (Outcome.DIVERGED, 0)
