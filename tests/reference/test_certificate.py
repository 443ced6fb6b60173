"""Laws of the certificate of a step: what it says is proven, and it says why where it is silent."""

import math

import numpy as np
import pytest
import scipy

from plumbob.reference import scenes
from plumbob.reference.implicit_euler import ImplicitEuler, certificate
from plumbob.reference.implicit_euler.certificate import (
    Certificate,
    Coverage,
    certify,
    hessian_change,
    laplacian_norm,
    least_curvature,
    scalar_bound,
)
from plumbob.reference.mass_spring import MassSpring, State

h = 0.05
EPS = np.finfo(float).eps


def step_of(system, state, **settings):
    """The objective of a step and Newton's answer to it."""
    integrator = ImplicitEuler(system, **{"h": h} | settings)
    return integrator.objective(state), integrator.step(state).state.positions


def free_hessian(objective, x):
    free = np.repeat(objective.system.free, 3)
    return objective.hessian(x).toarray()[np.ix_(free, free)]


def one_spring(pinned=(0,), springs=1):
    """A mass beside a pin, h² k = 1, by a spring of 1 m or several alike, the length 0.8 m."""
    system = MassSpring(
        [1.0, 1.0], [[0, 1]] * springs, 1.0, 1 / (h * h), pinned=pinned, gravity=(0, 0, 0)
    )
    return system, State([[0, 0, 0], [0.8, 0, 0]], np.zeros((2, 3)))


@pytest.fixture
def swing():
    """A 6 x 6 cloth in mid-swing."""
    system, state = scenes.lab_cloth(size=6, stiffness=1000.0, damping=0.2, gravity=9.81)
    integrator = ImplicitEuler(system, h=1 / 30)
    for _ in range(10):
        state = integrator.step(state).state
    return system, state


class TestCurvature:
    def curvature_is_below_every_eigenvalue(self, objective, x):
        least = np.linalg.eigvalsh(free_hessian(objective, x))[0]
        known = certify(objective, x).curvature
        # numpy's eigenvalues are rounded by some 1e-15 of the largest, 1e3 times the least.
        assert known <= least * (1 + 1e-11)
        assert known >= 0.95 * least

    @pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
    def test_it_is_below_every_eigenvalue_and_close(self, network, altered, scale):
        """Pins are cut out: an identity in their place would be the least of great masses."""
        system, state = network
        heavy = altered(
            system,
            masses=scale * system.masses,
            stiffnesses=scale * system.stiffnesses,
            dampings=scale * system.dampings,
        )
        self.curvature_is_below_every_eigenvalue(*step_of(heavy, state))

    def test_a_matrix_singular_to_rounding_has_none(self):
        H = scipy.sparse.csc_array(np.diag([1.0, 1e-15, 2.0]))
        assert least(H) == (0.0, None)
        mu, factor = least(scipy.sparse.csc_array(np.diag([1.0, 1e-12, 2.0])))
        assert 0.9e-12 < mu < 1e-12
        assert factor is not None

    def test_the_error_of_the_matrix_is_subtracted(self):
        H = scipy.sparse.csc_array(np.diag([1.0, 3.0, 2.0]))
        assert least_curvature(H, 0.25)[0] == pytest.approx(least(H)[0] - 0.25, rel=1e-12)
        assert least(H)[0] < certificate.FIRST_SHIFT - EPS


class TestScalarBound:
    """The bound of the Hessian of many particles, by one number for each pair of them."""

    @pytest.mark.parametrize("spread", [0.0, 0.3])
    def test_the_hessian_is_above_it(self, network, rng, spread):
        objective, x = step_of(*network)
        free = objective.system.free
        x = x + spread * rng.standard_normal(x.shape) * free[:, None]
        S = np.kron(scalar_bound(objective, x).toarray(), np.eye(3))
        H = free_hessian(objective, x)
        assert np.linalg.eigvalsh(H - S)[0] >= -1e-12 * np.linalg.norm(H)
        assert least_curvature(scalar_bound(objective, x), 0.0)[0] <= np.linalg.eigvalsh(H)[0]

    @pytest.mark.parametrize("length", [0.7, 1.3])
    def test_across_a_spring_it_is_the_hessian(self, length):
        """h² k = 1 and r = 1 m beside a mass of 1 kg."""
        system, state = one_spring()
        objective = ImplicitEuler(system, h=h).objective(state)
        x = np.array([[0.0, 0, 0], [length, 0, 0]])
        S = scalar_bound(objective, x).toarray()
        assert pytest.approx(1 + 1 - 1 / length, rel=1e-14) == S
        assert pytest.approx(free_hessian(objective, x)[1, 1], rel=1e-14) == S[0, 0]

    def test_a_slack_rope_adds_nothing(self):
        system = MassSpring([1, 2], [[0, 1]], 1.0, 1e3, pinned=[0], tension_only=True)
        x = np.array([[0.0, 0, 0], [0.5, 0, 0]])
        objective = ImplicitEuler(system, h=h).objective(State(x, np.zeros((2, 3))))
        assert scalar_bound(objective, x).toarray() == 2.0

    def test_many_particles_are_certified_without_the_factor(self, swing, monkeypatch):
        objective, x = step_of(*swing, h=1 / 60)
        sharp = certify(objective, x)
        monkeypatch.setattr(certificate, "MANY_PARTICLES", 20)
        monkeypatch.setattr(objective, "hessian_at", None)
        known = certify(objective, x)
        assert known.covered
        assert 0.5 * sharp.curvature < known.curvature <= 1.02 * sharp.curvature
        assert known.distance >= 0.1 * sharp.distance  # which is rounding only

    def test_where_springs_are_compressed_the_factor_decides(self, monkeypatch):
        """The bound of a mass between springs that are stretched and compressed is negative."""
        system = MassSpring(
            [1, 1, 1, 1], [[0, 1], [1, 2], [1, 3]], 1.0, [4e3, 1e4, 1e4], pinned=[0, 2, 3],
            gravity=(0, 0, 0),
        )  # fmt: skip
        x = np.array([[0.85, 0, 0], [0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
        objective = ImplicitEuler(system, h=h).objective(State(x, np.zeros((4, 3))))
        assert scalar_bound(objective, x).toarray() < 0
        sharp = certify(objective, x)
        monkeypatch.setattr(certificate, "MANY_PARTICLES", 0)
        assert certify(objective, x) == sharp
        assert sharp.curvature > 0.5


def least(H):
    return least_curvature(H, 0.0)


class TestHessianChange:
    def hessian_changes_no_faster(self, objective, x, radius, seed=0, pairs=40):
        """Return how close to L it comes between random points within the radius."""
        free, rng = objective.system.free, np.random.default_rng(seed)
        coverage, L = hessian_change(objective, x, radius)
        assert coverage == Coverage.COVERED
        steepest = 0.0
        for _ in range(pairs):
            directions = rng.standard_normal((2, *x.shape)) * free[:, None]
            a, b = (x + radius * rng.uniform(0.5, 1) * w / np.linalg.norm(w) for w in directions)
            change = free_hessian(objective, a) - free_hessian(objective, b)
            steepest = max(steepest, np.linalg.norm(change, 2) / np.linalg.norm(a - b))
        assert steepest <= L
        return steepest / L

    @pytest.mark.parametrize("radius", [1e-3, 0.01])
    def test_between_any_two_points_it_is_at_most_lipschitz(self, network, radius):
        objective, x = step_of(*network)
        assert self.hessian_changes_no_faster(objective, x, radius) > 0.05

    def steepest(self, objective, x, pinned):
        """Along (1, 2^1/2, 0) / 3^1/2 the length has its largest third derivative."""
        direction = np.zeros((2, 3))
        direction[1] = np.array([1.0, math.sqrt(2.0), 0.0]) / math.sqrt(3.0)
        if not pinned:
            direction[0] = -direction[1]
        direction /= np.linalg.norm(direction)
        step = 1e-6
        change = free_hessian(objective, x + step * direction) - free_hessian(
            objective, x - step * direction
        )
        return np.linalg.norm(change, 2) / (2 * step)

    @pytest.mark.parametrize("pinned", [(0,), ()])
    @pytest.mark.parametrize("springs", [1, 3])
    def test_of_parallel_springs_it_is_no_larger_than_it_must_be(self, pinned, springs):
        system, state = one_spring(pinned, springs)
        objective = ImplicitEuler(system, h=h).objective(state)
        _, L = hessian_change(objective, state.positions, 0.0)
        # All bounds are taken 1e-8 too large to be on the safe side of their own rounding.
        steepest = self.steepest(objective, state.positions, pinned)
        assert pytest.approx(steepest, rel=1e-7) == L

    @pytest.mark.parametrize(("pinned", "radius"), [((0,), 0.4), ((), 0.4 / math.sqrt(2.0))])
    def test_within_a_radius_the_spring_may_be_half_as_long(self, pinned, radius):
        """Both ends free and moving against each other, each goes 2^-1/2 of the radius."""
        system, state = one_spring(pinned)
        objective = ImplicitEuler(system, h=h).objective(state)
        there, far = (hessian_change(objective, state.positions, r)[1] for r in (0.0, radius))
        assert far == pytest.approx(4 * there, rel=1e-7)

    def test_springs_that_are_linear_or_slack_or_pinned_do_not_count(self, altered):
        system = MassSpring(
            [1, 1, 1], [[0, 1], [0, 1], [0, 2], [0, 1]], [0.0, 2.0, 1.0, 1.0],
            [10.0, 10.0, 10.0, 0.0], pinned=[0, 2], tension_only=[False, True, True, False],
        )  # fmt: skip
        x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        objective = ImplicitEuler(system, h=h).objective(State(x, np.zeros((3, 3))))
        assert hessian_change(objective, x, 0.1) == (Coverage.COVERED, 0.0)
        stiff = altered(system, tension_only=False)  # and the spring of 2 m pushes
        objective = ImplicitEuler(stiff, h=h).objective(State(x, np.zeros((3, 3))))
        assert hessian_change(objective, x, 0.1)[1] > 0.01

    def test_the_norm_is_no_less_than_the_laplacians(self, network, rng):
        system, _ = network
        weights = rng.uniform(0, 1, len(system.springs))
        A = system.free_incidence.toarray()
        norm = np.linalg.norm(A * weights @ A.T, 2)
        bound = laplacian_norm(system.free, system.springs, weights)
        assert norm <= bound <= 2 * norm


class TestDistance:
    def test_it_is_zero_if_all_particles_are_pinned(self):
        system = MassSpring([1.0, 0.0], [[0, 1]], 1.0, 1.0, pinned=[0, 1])
        known = certify(*step_of(system, State(np.eye(3)[:2], np.ones((2, 3)))))
        assert known.covered
        assert (known.distance, known.unique_within) == (0.0, math.inf)

    def test_a_result_is_certified_with_the_arguments_of_its_step(self, network, rng):
        system, state = network
        integrator = ImplicitEuler(system, h=h)
        given = rng.standard_normal((7, 3)), state.positions[system.pinned] + 0.1
        result = integrator.step(state, *given)
        known = integrator.certify(state, result, *given)
        assert known.covered
        assert known.residual == result.residual
        assert known == certify(integrator.objective(state, *given), result.state.positions)
        assert integrator.certify(state, result).coverage == Coverage.PINS_ASTRAY


class TestReasons:
    """Each reason for no bound has its case."""

    def rope(self, length):
        """A mass on a tension-only spring of 1 m, h² k = 1."""
        system = MassSpring(
            [1, 1], [[0, 1]], 1.0, 1 / h**2, pinned=[0], gravity=(0, 0, 0), tension_only=True
        )
        return system, State([[0, 0, 0], [length, 0, 0]], np.zeros((2, 3)))

    def start(self, system, state):
        return certify(ImplicitEuler(system, h=h).objective(state), state.positions)

    def long_step(self, mass, state):
        """g of a step of 1e5 s of a mass on the stiffest spring there may be, h² k = 1e85."""
        system = MassSpring([mass, mass], [[0, 1]], 1.0, 1e75, pinned=[0], gravity=(0, 0, 0))
        with np.errstate(over="ignore", invalid="ignore"):
            return ImplicitEuler(system, h=1e5, solver="newton_cg").objective(state)

    def test_a_gradient_that_overflows(self):
        huge = State(1e75 * np.eye(3)[:2], np.zeros((2, 3)))
        known = certify(self.long_step(1e75, huge), huge.positions)
        assert (known.coverage, known.residual) == (Coverage.OVERFLOWN, math.inf)

    def test_a_pin_that_is_not_where_it_has_to_be(self):
        system, state = one_spring()
        objective = ImplicitEuler(system, h=h).objective(state)
        assert certify(objective, state.positions + 1e-9).coverage == Coverage.PINS_ASTRAY

    def test_a_saddle(self):
        system = MassSpring(
            [1, 1, 1], [[0, 1], [1, 2]], 1.0, 1000.0, pinned=[0, 2], gravity=(0, 0, 0)
        )
        state = State([[-0.5, 0, 0], [0, 0, 0], [0.5, 0, 0]], np.zeros((3, 3)))
        known = self.start(system, state)
        assert (known.coverage, known.residual, known.curvature) == (Coverage.NOT_CONVEX, 0.0, 0.0)

    def test_ends_that_coincide(self):
        system, state = one_spring()
        known = self.start(system, State(0 * state.positions, np.zeros((2, 3))))
        assert known.coverage == Coverage.COINCIDENT

    def test_ends_that_may_meet_along_the_step(self):
        """Stretched far, the spring will contract, and the bound cannot tell by how much."""
        system = MassSpring([1, 1], [[0, 1]], 0.01, 1 / h**2, pinned=[0], gravity=(0, 0, 0))
        state = State([[0, 0, 0], [0.8, 0, 0]], [[0, 0, 0], [-12.0, 0, 0]])
        known = self.start(system, state)
        assert known.coverage == Coverage.COINCIDENT
        assert known.newton_step > 0.2

    def test_a_slack_rope_between_coincident_particles_does_no_harm(self):
        system = MassSpring([1, 1], [[0, 1]], 1.0, 1 / h**2, gravity=(0, 0, 0), tension_only=True)
        assert self.start(system, State(np.zeros((2, 3)), np.zeros((2, 3)))).covered

    def test_a_rope_exactly_taut(self):
        assert self.start(*self.rope(1.0)).coverage == Coverage.KINK

    def test_a_rope_that_may_go_slack_along_the_step(self):
        known = self.start(*self.rope(1.2))
        assert known.coverage == Coverage.KINK
        assert known.newton_step > 0.05

    @pytest.mark.parametrize("length", [0.9, 1.1])
    def test_a_rope_that_stays_as_it_is_does_no_harm(self, length):
        """Slack, or carrying a load that h² k = 1 balances."""
        system, state = self.rope(length)
        load = np.array([[0, 0, 0], [max(length - 1, 0.0), 0, 0]]) / h**2
        objective = ImplicitEuler(system, h=h).objective(state, load)
        assert certify(objective, state.positions).covered

    def test_a_point_too_far_away(self):
        system, state = one_spring()
        moving = State(state.positions, [[0, 0, 0], [0, 5.0, 0]])
        known = self.start(system, moving)
        assert known.coverage == Coverage.TOO_FAR
        assert known.lipschitz * known.newton_step > 0.5 * known.curvature
        assert known.distance == math.inf
        assert known.unique_within == 0

    def test_too_far_begins_where_kantorovichs_theorem_ends(self):
        system, state = one_spring()
        shares = []
        for backend in np.linspace(0.5, 5.0, 19):
            known = self.start(system, State(state.positions, [[0, 0, 0], [0, backend, 0]]))
            shares.append(known.lipschitz * known.newton_step / known.curvature)
            assert known.covered == (shares[-1] < 0.5)
        assert any(0.25 < share < 0.5 for share in shares)
        assert max(shares) > 0.5

    def test_every_reason_has_a_sentence(self):
        sentences = {reason.sentence for reason in Coverage}
        assert len(sentences) == len(Coverage)
        assert all(s.startswith("No bound") for s in sentences - {Coverage.COVERED.sentence})


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
