"""Laws of g, of the implicit Euler step and of every solver."""

import itertools

import numpy as np
import pytest

from plumbob.reference import scenes
from plumbob.reference.backend import compiled
from plumbob.reference.implicit_euler import STARTS, STEP_SOLVERS, ImplicitEuler
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
    lengths,
)
from plumbob.reference.outcome import Outcome

h = 0.05
CONVERGING = ["local_global", "chebyshev", "lbfgs", "newton", "newton_cg"]


@pytest.fixture(params=STEP_SOLVERS)
def solver(request):
    return request.param


@pytest.fixture
def cloth():
    """A 5 x 5 cloth with dampers, swinging fast."""
    system, state = scenes.lab_cloth(size=5, damping=0.2)
    v = np.cross(state.positions - state.positions[0], [0.3, 0.5, 2.0])
    return system, State(state.positions, v)


def stepped(system, state, solver="newton", external_forces=None, **settings):
    """Return the result of one step of length h."""
    return ImplicitEuler(system, **{"h": h, "solver": solver} | settings).step(
        state, external_forces
    )


def beside(system, x_n):
    """Return ends, stiffnesses, rest lengths and tension_only of springs and then of dampers.

    Through a step a damper is a spring of stiffness c/h whose rest length is its last length.
    """
    return (
        np.concatenate([system.springs, system.springs]),
        np.concatenate([system.stiffnesses, system.dampings / h]),
        np.concatenate([system.rest_lengths, lengths(system, x_n)]),
        np.concatenate([system.tension_only, np.zeros(len(system.springs), dtype=bool)]),
    )


def outer(rng):
    return rng.standard_normal((7, 3))


class TestObjective:
    @pytest.fixture
    def problem(self, network, rng):
        """g of the damped network under outer forces, and a point away from y."""
        objective = ImplicitEuler(network[0], h=h).objective(network[1], outer(rng))
        return objective, objective.y + 0.1 * outer(rng)

    def test_value_is_the_derivations_with_dampers_in_e(self, problem, network, rng, backend):
        objective, x = problem
        system, state = network
        y = state.positions + h * state.velocities
        y[2] = state.positions[2]
        np.testing.assert_array_equal(objective.y, y)
        inertia = np.sum(system.masses[:, None] * (x - y) ** 2) / 2
        _, k, r, rope = beside(system, state.positions)
        stretch = np.tile(lengths(system, x), 2) - r
        stretch[rope & (stretch < 0)] = 0
        energy = np.sum(k / 2 * stretch**2) - np.sum(objective.external * x)
        assert objective.value(x) == pytest.approx(inertia + h * h * energy, rel=1e-14, abs=0)


class TestStep:
    def test_velocities_are_displacements_over_h(self, network, solver, backend):
        after = stepped(*network, solver, max_iterations=2).state
        displacement = after.positions - network[1].positions
        np.testing.assert_array_equal(after.velocities, displacement / h)
        assert (displacement[2] == 0).all()  # the pin's
        assert np.abs(displacement).max() > 0.01

    @pytest.mark.parametrize("name", ["chebyshev", "lbfgs"])
    def test_acceleration_saves_half_the_iterations(self, cloth, name):
        one, other = (
            stepped(*cloth, solver, tolerance=1e-9, max_iterations=3000)
            for solver in (name, "local_global")
        )
        assert one.outcome == other.outcome == Outcome.CONVERGED
        assert one.iterations < 0.5 * other.iterations

    @pytest.mark.parametrize("name", ["local_global", "chebyshev", "lbfgs", "newton_cg"])
    def test_g_never_grows_in_an_iteration(self, cloth, backend, name):
        integrator = ImplicitEuler(*cloth[:1], h=h, solver=name)
        iterates = list(itertools.islice(integrator.iterates(cloth[1]), 30))
        for before, after in itertools.pairwise(iterates):
            assert after.value <= before.value + after.value_floor
        assert iterates[-1].value < iterates[0].value - 1e-4
        assert iterates[-1].value_floor < 1e-12

    def test_newton_converges_quadratically(self, cloth):
        residuals = stepped(*cloth).history
        assert residuals[0] == 1
        assert residuals[-1] < 1e-10
        assert len(residuals) <= 6
        assert residuals[-2] < 10 * residuals[-3] ** 2

    def test_conjugate_gradients_converge_faster_than_linearly(self, cloth):
        residuals = stepped(*cloth, "newton_cg").history
        assert residuals[-1] < 1e-10
        assert len(residuals) <= 8
        assert residuals[-2] < residuals[-3] ** 1.3

    @pytest.mark.parametrize("name", ["newton", "newton_cg"])
    def test_newton_descends_from_a_point_where_g_is_not_convex(self, backend, name):
        """A flat cloth squeezed within its plane: the Hessian at y has negative eigenvalues."""
        system, state = scenes.lab_cloth(size=4, stiffness=1000.0)
        inwards = State(state.positions, 10 * (state.positions.mean(axis=0) - state.positions))
        integrator = ImplicitEuler(system, h=h, solver=name, max_iterations=200)
        objective = integrator.objective(inwards)
        assert np.linalg.eigvalsh(objective.hessian(objective.y).toarray())[0] < -0.1
        result = integrator.step(inwards)
        assert result.outcome == Outcome.CONVERGED
        assert (np.diff(result.objectives) <= 1e-12).all()
        end = objective.hessian(result.state.positions).toarray()
        assert np.linalg.eigvalsh(end)[0] > 0

    @pytest.mark.parametrize("name", ["local_global", "chebyshev"])
    def test_an_iteration_is_that_of_liu_et_al(self, network, rng, backend, name):
        """(M + h² L) x = h² J d + M y + h² f_ext with d from x_n or y, the pins eliminated."""
        system, state = network
        given = outer(rng)
        x = stepped(system, state, name, given, start="x_n", tolerance=0, max_iterations=1).state
        expected = published_iteration(system, state, given, state.positions)
        # Two solves of seven unknowns, whose matrices have condition numbers of about 3.
        np.testing.assert_allclose(x.positions, expected, rtol=0, atol=2e-15)
        from_y = stepped(system, state, name, given, tolerance=0, max_iterations=1).state
        assert np.abs(from_y.positions - expected).max() > 1e-4
        y = ImplicitEuler(system, h=h).objective(state).y
        expected = published_iteration(system, state, given, y)
        np.testing.assert_allclose(from_y.positions, expected, rtol=0, atol=1e-14)

    @pytest.mark.parametrize("name", CONVERGING)
    def test_from_every_start_a_solver_comes_to_the_same_minimiser(self, cloth, name):
        pins = cloth[1].positions[cloth[0].pinned] + [0.0, 0.02, 0.01]
        integrators = [ImplicitEuler(cloth[0], h=h, solver=name, start=at) for at in STARTS]
        results = [integrator.step(cloth[1], pin_positions=pins) for integrator in integrators]
        starts = [next(one.iterates(cloth[1], pin_positions=pins)) for one in integrators]
        for one, other in itertools.combinations(starts, 2):
            assert np.abs(one.positions - other.positions).max() > 0.001
        for result, start in zip(results, starts, strict=True):
            np.testing.assert_array_equal(start.positions[cloth[0].pinned], pins)
            assert result.outcome == Outcome.CONVERGED
            assert result.objectives[0] == start.value
            # Both residuals are below 1e-10.
            ends = result.state.positions, results[0].state.positions
            np.testing.assert_allclose(*ends, rtol=0, atol=1e-9)

    def test_an_explicit_start_saves_iterations_on_a_stiff_frame(self):
        system, state = scenes.lab_cloth(size=12, stiffness=1e4)
        counts = [
            ImplicitEuler(system, h=1 / 30, start=start).step(state).iterations
            for start in ("explicit", "y")
        ]
        assert counts[0] < counts[1]

    @pytest.mark.parametrize(("stiffness", "speed"), [(1e12, 0.0), (1.0, 1e75)])
    def test_without_an_explicit_start_the_step_starts_at_y(self, stiffness, speed):
        """It would take too many steps, or overflow."""
        system, state = scenes.hanging_rope(particles=4, stiffness=stiffness)
        fast = State(state.positions, np.where(system.free[:, None], speed, 0.0) + np.zeros((4, 3)))
        ends = [stepped(system, fast, start=start, max_iterations=9) for start in ("explicit", "y")]
        np.testing.assert_array_equal(ends[0].history, ends[1].history)
        assert ends[0].outcome == ends[1].outcome

    def test_gauss_newton_starts_only_at_x_n(self, cloth):
        assert ImplicitEuler(cloth[0], solver="gauss_newton").start == "x_n"
        with pytest.raises(ValueError, match="start: expected one of x_n, got 'y'"):
            ImplicitEuler(cloth[0], solver="gauss_newton", start="y")


def published_iteration(system, state, given, start):
    """Return one iteration of Liu et al. 2013 from a start, dense, springs and dampers apart."""
    ends, k, r, rope = beside(system, state.positions)
    x_n, free, A = state.positions, system.free, np.zeros((len(system.masses), len(ends)))
    A[ends[:, 0], range(len(ends))], A[ends[:, 1], range(len(ends))] = 1.0, -1.0
    p = A.T @ start
    length = np.linalg.norm(p, axis=1)
    d = np.where(rope & (length < r), length, r)[:, None] * p / length[:, None]
    M, L, J = np.diag(system.masses), A @ np.diag(k) @ A.T, A @ np.diag(k)
    y = x_n + h * state.velocities
    right = h * h * (J @ d) + M @ y + h * h * (M @ np.tile(system.gravity, (len(M), 1)) + given)
    left, x = M + h * h * L, x_n.copy()
    x[free] = np.linalg.solve(
        left[np.ix_(free, free)], right[free] - left[np.ix_(free, ~free)] @ x_n[~free]
    )
    return x


class TestResidual:
    def residual(self, system, state, x, given):
        """Return the residual and the floor by their definition, in extended precision."""
        wide = np.longdouble
        m = system.masses.astype(wide)[:, None]
        x_n, free = state.positions.astype(wide), system.free
        x = x.astype(wide)
        y = np.where(free[:, None], x_n + wide(h) * state.velocities.astype(wide), x_n)
        springs, k, r, rope = beside(system, state.positions)
        i, j = springs.T
        external = m * system.gravity + given

        def gradient(x):
            length = np.sqrt(np.sum((x[i] - x[j]) ** 2, axis=1))
            stretch = np.where(rope, np.maximum(length - r, 0), length - r)
            pull = (k * stretch / length)[:, None] * (x[i] - x[j])
            total = np.zeros_like(x)
            np.add.at(total, i, pull)
            np.subtract.at(total, j, pull)
            return np.sqrt(np.sum((m * (x - y) + h * h * (total - external))[free] ** 2))

        reach = np.sqrt(np.sum(x**2, axis=1))
        size = m[:, 0] * (reach + np.sqrt(np.sum(y**2, axis=1)))
        size += h * h * np.sqrt(np.sum(external**2, axis=1))
        for end in (i, j):
            np.add.at(size, end, h * h * k * (reach[i] + reach[j] + r))
        floor = 64 * np.finfo(float).eps * np.sqrt(np.sum(size[free] ** 2))
        return gradient(x), max(gradient(y), floor), floor

    @pytest.mark.parametrize("iterations", [0, 1, 3])
    def test_it_agrees_with_its_definition(self, network, rng, backend, solver, iterations):
        given = outer(rng)
        result = stepped(*network, solver, given, tolerance=0, max_iterations=iterations)
        norm, scale, floor = self.residual(*network, result.state.positions, given)
        # The norm in double precision is off by less than the floor, which is an upper bound.
        assert abs(result.residual - norm / scale) <= floor / scale
        assert result.residual > 1e-12 or solver != "local_global"

    def test_the_floor_agrees_with_its_definition(self, network, rng, backend):
        given = outer(rng)
        objective = ImplicitEuler(network[0], h=h).objective(network[1], given)
        x = network[1].positions + 0.1
        _, _, floor = self.residual(*network, x, given)
        assert objective.evaluate(x).floor == pytest.approx(float(floor), rel=1e-14, abs=0)

    def test_history_is_the_residual_before_and_after_each_iteration(self, network, solver):
        system, state = network
        integrator = ImplicitEuler(system, h=h, solver=solver, tolerance=0, max_iterations=3)
        result = integrator.step(state)
        objective = integrator.objective(state)
        iterates = list(itertools.islice(integrator.iterates(state), 4))
        assert result.history.tolist() == [objective.residual(x) for x in iterates]
        assert result.objectives.tolist() == [x.value for x in iterates]
        assert result.history[-1] == result.residual
        np.testing.assert_array_equal(iterates[-1].positions, result.state.positions)


class TestOutcome:
    def test_a_start_at_rest_is_converged_after_no_iteration(self, solver, backend):
        system, state = scenes.hanging_rope(particles=5, gravity=0.0)
        result = stepped(system, state, solver)
        assert (result.outcome, result.iterations) == (Outcome.CONVERGED, 0)
        assert result.residual == 0
        np.testing.assert_array_equal(result.state.positions, state.positions)

    def test_a_start_at_equilibrium_is_at_rounding_after_no_iteration(self, solver, backend):
        """Rounding leaves a gradient there, which is all the gradient there is."""
        system, state = hanging(6)
        result = stepped(system, state, solver)
        assert (result.outcome, result.iterations) == (Outcome.AT_ROUNDING, 0)
        assert result.at_floor
        assert result.residual <= 1

    @pytest.mark.parametrize("name", CONVERGING)
    def test_converged_means_within_the_tolerance(self, cloth, name):
        for tolerance in (1e-2, 1e-5, 1e-8, 1e-12):
            result = stepped(*cloth, name, tolerance=tolerance)
            assert result.outcome == Outcome.CONVERGED
            assert result.residual <= tolerance
            assert (result.history[:-1] > tolerance).all()

    @pytest.mark.parametrize("place", [0.0, 1e4])
    @pytest.mark.parametrize("name", CONVERGING)
    def test_at_rounding_means_as_near_as_newton_comes(self, cloth, name, place):
        """10 km from the origin the floor is far above the tolerance, and what is attained is."""
        system, state = cloth
        displaced = State(state.positions + place, state.velocities)
        best, result = (
            stepped(system, displaced, solver, tolerance=1e-75, max_iterations=2000)
            for solver in ("newton", name)
        )
        assert best.outcome == result.outcome == Outcome.AT_ROUNDING
        # What rounding leaves differs from solver to solver; an accelerated one amplifies it.
        assert result.residual <= 30 * best.residual
        assert result.residual > 0

    @pytest.mark.parametrize("name", CONVERGING)
    def test_a_start_within_the_floor_is_iterated(self, cloth, name):
        """Newton's answer, its particles off by a thousandth of what the floor allows."""
        system, state = hanging(6)
        noise = np.random.default_rng(5).standard_normal((6, 3))
        beside = State(state.positions + 3e-15 * noise, np.zeros((6, 3)))
        objective = ImplicitEuler(system, h=h).objective(beside)
        assert objective.start.at_floor
        assert not objective.start.at_rest
        result = stepped(system, beside, name)
        assert result.outcome == Outcome.AT_ROUNDING
        assert result.iterations > 2
        assert result.residual < 0.2 * result.history[0]

    @pytest.mark.parametrize("count", [0, 1, 7])
    def test_without_tolerance_all_iterations_are_run(self, network, solver, count):
        result = stepped(*network, solver, tolerance=0, max_iterations=count)
        assert result.iterations == count
        assert len(result.history) == len(result.objectives) == count + 1

    @pytest.mark.parametrize("bad", [np.nan, np.inf])
    def test_after_an_overflow_the_last_finite_iterate_is_returned(self, cloth, monkeypatch, bad):
        class Bursting:
            default_iterations = 50

            def __init__(self, system, h):
                pass

            def iterates(self, objective):
                yield objective.start
                yield objective.evaluate(objective.y + 0.01)
                yield objective.iterate_at(np.full_like(objective.y, bad))

        monkeypatch.setitem(STEP_SOLVERS, "bursting", Bursting)
        result = stepped(*cloth, "bursting")
        assert (result.outcome, result.iterations) == (Outcome.DIVERGED, 1)
        y = ImplicitEuler(cloth[0], h=h).objective(cloth[1]).y
        np.testing.assert_array_equal(result.state.positions, y + 0.01)
        assert np.isfinite(result.history).all()

    @pytest.mark.parametrize(
        ("positions", "velocities"), [(1e75, 1.0), (1.0, 1e75)], ids=["positions", "velocities"]
    )
    def test_a_start_that_overflows_is_returned_unmoved(
        self, solver, backend, positions, velocities
    ):
        system = MassSpring([1e75, 2e74], [[0, 1]], 1.0, 1e75)
        state = State(positions * np.eye(3)[:2], velocities * np.ones((2, 3)))
        result = stepped(system, state, solver, h=1e5)
        assert (result.outcome, result.iterations) == (Outcome.DIVERGED, 0)
        assert result.residual == np.inf
        np.testing.assert_array_equal(result.state.positions, state.positions)


def hanging(particles):
    """Return a rope in equilibrium, spring i stretched by the weight of what is below it."""
    system, state = scenes.hanging_rope(particles=particles, mass=0.3, stiffness=40.0)
    below = np.arange(particles - 1, 0, -1)
    springs = system.rest_lengths + below * 0.3 * 9.81 / 40.0
    x = np.zeros((particles, 3))
    x[1:, 1] = -np.cumsum(springs)
    return system, State(x, np.zeros((particles, 3)))


class TestMotion:
    @pytest.mark.parametrize("factor", [1, 100])
    def test_newton_solves_every_step_of_the_swinging_lab_cloth(self, factor):
        system, state = scenes.lab_cloth(stiffness=100.0 * factor)
        integrator = ImplicitEuler(system)
        swung = []
        for _ in range(60):
            result = integrator.step(state)
            assert result.outcome == Outcome.CONVERGED
            assert result.residual <= 1e-10
            assert result.iterations <= 5
            state = result.state
            swung.append(np.abs(state.velocities).max())
        assert max(swung) > 0.2


class TestBackends:
    """Both backends give the same results."""

    def test_both_speeds_agree_to_the_rounding_of_their_factors(self, network, solver):
        """A solve and a gradient away from positions of about 1 m."""
        ends = []
        for name in compiled.BACKENDS:
            with compiled.set_backend(name):
                result = stepped(*network, solver, tolerance=0, max_iterations=2)
                ends.append(result.state.positions)
        np.testing.assert_allclose(*ends, rtol=0, atol=1e-13)
        assert np.abs(ends[0] - network[1].positions).max() > 0.01


class TestInputs:
    @pytest.mark.parametrize(
        ("name", "value", "message"),
        [
            ("h", 0.0, "greater than 0"),
            ("h", -1.0, "greater than 0"),
            ("solver", "simplex", f"one of {', '.join(STEP_SOLVERS)}, got 'simplex'"),
            ("tolerance", -1e-3, "at least 0"),
            ("max_iterations", -1, "at least 0"),
            ("max_iterations", 10**12, "at most 100,000,000"),  # the memory of a step's history
            ("start", "z", "one of y, x_n, explicit, got 'z'"),
            ("start", 1, "one of y, x_n, explicit, got 1"),
        ],
    )
    def test_wrong_settings_are_named(self, cloth, name, value, message):
        with pytest.raises(ValueError, match=f"^{name}: .*{message}"):
            ImplicitEuler(cloth[0], **{name: value})


class TestUnusualSystems:
    def test_particles_without_springs_fall_freely(self, solver, backend):
        system = MassSpring([1.0, 2.0], np.empty((0, 2)), 1.0, 1.0, gravity=(0, -10, 0))
        state = State(np.zeros((2, 3)), [[1.0, 0, 0], [0, 0, 0]])
        after = stepped(system, state, solver).state
        expected = [[1.0, -0.5, 0], [0, -0.5, 0]]
        np.testing.assert_allclose(after.velocities, expected, rtol=0, atol=1e-15)

    @pytest.mark.parametrize("name", CONVERGING)
    def test_coincident_particles_are_driven_apart(self, name, backend):
        system = MassSpring([1.0, 1.0], [[0, 1]], 1.0, 100.0, gravity=(0, 0, 0))
        result = stepped(system, State(np.zeros((2, 3)), np.zeros((2, 3))), name)
        assert result.outcome == Outcome.CONVERGED
        assert lengths(system, result.state.positions)[0] > 0.2

    @pytest.mark.parametrize("tension_only", [False, True])
    @pytest.mark.parametrize("name", CONVERGING)
    def test_springs_without_rest_length_are_solved_at_once(
        self, name, backend, tension_only, network, altered
    ):
        """g is quadratic, and M + h² L is its Hessian; Newton-CG has it in single precision."""
        system, state = network
        linear = altered(system, rest_lengths=0.0, dampings=0.0, tension_only=tension_only)
        tolerance = 1e-6 if name == "newton_cg" else 1e-12
        result = stepped(linear, state, name, tolerance=tolerance)
        assert (result.outcome, result.iterations) == (Outcome.CONVERGED, 1)
