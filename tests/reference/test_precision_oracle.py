"""Forces, steps and certificates beside the same in 50 digits."""

import itertools

import extended_precision
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plumbob.reference.implicit_euler import STEP_SOLVERS, ImplicitEuler, certificate
from plumbob.reference.implicit_euler.certificate import (
    RoundingErrors,
    certify,
    laplacian_norm,
    rounding_errors,
)
from plumbob.reference.mass_spring import (
    MassSpring,
    State,
)

# Step and error of a central difference in 50 digits.
DX, DIFFERENCE = 1e-16, 1e-28
CONVERGING = [name for name in STEP_SOLVERS if name != "gauss_newton"]

# What a proof may forget: name and stand-in of a function of the certificate.
FAULTS = {
    "half of Newton's step": ("kantorovich_distance", lambda eta, share: eta / 2),
    "the Hessian does not change": ("kantorovich_distance", lambda eta, share: eta),
    "nothing is rounded": ("rounding_errors", lambda objective, x: RoundingErrors(0.0, 0.0)),
    "L a hundredth": ("laplacian_norm", lambda *springs: laplacian_norm(*springs) / 100),
}

seeds = st.integers(min_value=0, max_value=10**6)


def random_motion(seed, *, mildly=False):
    """Two to five particles, some pinned, in any state: system, state, forces, pins' targets and h.

    Springs and ropes, damped or not, some without a rest length, stretched and compressed by up to
    a half, anywhere within 100 m; "mildly" not far from rest.
    """
    rng = np.random.default_rng([7, seed])
    n = int(rng.integers(2, 6))
    springs = np.array([(i, j) for i in range(n) for j in range(i) if rng.random() < 0.8 or j == 0])
    x = rng.standard_normal((n, 3)) + rng.choice([0.0, 1.0, 100.0]) * rng.standard_normal(3)
    length = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)
    s, strain = len(springs), 0.02 if mildly else 0.5
    system = MassSpring(
        masses=10.0 ** rng.uniform(-1, 1, n),
        springs=springs,
        rest_lengths=np.where(
            rng.random(s) < 0.1, 0, length * (1 + rng.uniform(-strain, strain, s))
        ),
        stiffnesses=10.0 ** rng.uniform(0, 4 if mildly else 6, s),
        dampings=np.where(rng.random(s) < 0.5, 0, rng.uniform(0.1, 5, s)),
        pinned=rng.choice(n, int(rng.integers(0, 2)), replace=False),
        gravity=rng.standard_normal(3) * 5,
        tension_only=rng.random(s) < 0.2,
    )
    pins_at = x[system.pinned] + 0.01 * rng.standard_normal((len(system.pinned), 3))
    h = float(rng.choice([1 / 240, 1 / 60, 1 / 30]))
    return system, State(x, rng.standard_normal((n, 3))), rng.standard_normal((n, 3)), pins_at, h


def disturbed(seed, exponent, *, mildly=False):
    """The objective of a step and a point 10^exponent beside where Newton's method ends."""
    system, state, forces, pins_at, h = random_motion(seed, mildly=mildly)
    integrator = ImplicitEuler(system, h=h, tolerance=1e-14)
    x = integrator.step(state, forces, pins_at).state.positions
    direction = np.random.default_rng([8, seed]).standard_normal(x.shape)
    direction[system.pinned] = 0.0
    objective = integrator.objective(state, forces, pins_at)
    return objective, x + 10.0**exponent * direction / np.linalg.norm(direction)


class TestOracle:
    """It is right by itself."""

    @pytest.fixture
    def step(self, network):
        return extended_precision.Step(*network, 0.05)

    @pytest.fixture
    def x(self, step, rng):
        return step.x_n + np.where(
            step.free[:, None], extended_precision.wide(0.1 * rng.standard_normal((7, 3))), 0
        )

    def test_gradient_and_hessian_are_slopes(self, step, x, rng):
        direction = np.where(
            step.free[:, None],
            extended_precision.wide(rng.standard_normal((7, 3))),
            extended_precision.wide(np.zeros(3)),
        )
        there, back = x + DX * direction, x - DX * direction
        slope = (step.value(there) - step.value(back)) / (2 * DX)
        assert abs(slope - np.sum(step.gradient(x) * direction)) < DIFFERENCE * abs(slope)
        bend = (step.gradient(there) - step.gradient(back))[step.free].ravel() / (2 * DX)
        product = step.hessian(x) @ direction[step.free].ravel()
        assert max(abs(bend - product)) < DIFFERENCE * max(abs(bend))


class TestForces:
    """They are off by some roundings of k (l + r), wherever the system lies."""

    @given(seeds, st.floats(-8.0, -1.0))
    def test_gradient_and_hessian_are_off_by_no_more_than_allowed_for(self, seed, exponent):
        objective, x = disturbed(seed, exponent)
        error = self.within_what_is_allowed(oracle_of(seed), objective, x)
        assert error <= objective.evaluate(x).floor

    def within_what_is_allowed(self, oracle, objective, x):
        """Return by how much the gradient is off."""
        allowed, there = rounding_errors(objective, x), np.vectorize(mpmath.mpf, otypes=[object])(x)
        error = objective.gradient(x) - oracle.gradient(there)
        off = float(mpmath.sqrt(np.sum(error * error)))
        assert off <= allowed.gradient
        exact, free = oracle.hessian(there), np.repeat(objective.system.free, 3)
        error = exact - objective.hessian(x)[free][:, free].toarray()
        assert np.linalg.norm(error.astype(float), 2) <= allowed.hessian
        return off


class TestSteps:
    @settings(max_examples=6)
    @given(seeds)
    def test_every_solver_ends_at_the_minimiser(self, seed):
        system, state, forces, pins_at, h = random_motion(seed, mildly=True)
        oracle = oracle_of(seed, mildly=True)
        for solver in CONVERGING:
            integrator = ImplicitEuler(
                system, h=h, solver=solver, tolerance=1e-14, max_iterations=3000
            )
            result = integrator.step(state, forces, pins_at)
            known = integrator.certify(state, result, forces, pins_at)
            error = distance_to_minimiser(oracle, result.state.positions)
            assert known.covered
            assert error <= known.distance
            assert known.distance <= 1e-11 * (1 + np.abs(state.positions).max())

    @settings(max_examples=6)
    @given(seeds)
    def test_gauss_newton_is_its_linear_step(self, seed):
        system, state, forces, _, h = random_motion(seed)
        oracle = extended_precision.Step(system, state, h, forces)
        exact = oracle.gauss_newton()
        # The gradient is rounded as any, and a positive definite solve amplifies it.
        H = oracle.hessian(oracle.x_n, geometric=False).astype(float)
        integrator = ImplicitEuler(system, h=h, solver="gauss_newton")
        for limit in (0, 10_000):  # by a factor and by conjugate gradients
            integrator._solver._iteration_limit = limit
            ours = integrator.step(state, forces).state.positions
            floor = integrator.objective(state, forces).evaluate(ours).floor
            error = extended_precision.norm(exact - ours)
            assert error <= floor / np.linalg.eigvalsh(H)[0]


@pytest.fixture(scope="module")
def beside_minimisers():
    """Points further and further from minimisers: objective, x, and the true distance or infinity.

    It is infinite where Newton's method does not come from x to a minimiser.
    """
    points = []
    for seed, exponent in itertools.product(range(8), (-14, -5, -2, -1)):
        objective, x = disturbed(seed, exponent)
        end = oracle_of(seed).minimiser(x)
        error = np.inf if end is None else extended_precision.norm(end - extended_precision.wide(x))
        points.append((objective, x, float(error)))
    return points


class TestCertificate:
    @given(seeds, st.floats(-14.0, 0.0))
    def test_a_minimiser_is_within_the_distance(self, seed, exponent):
        objective, x = disturbed(seed, exponent)
        known = certify(objective, x)
        if known.covered:
            oracle = oracle_of(seed)
            error = distance_to_minimiser(oracle, x)
            assert error <= known.distance
            # |p| <= t + L t² / (2 mu) <= 3/2 t for the true distance t, and d <= 2 eta.
            allowed = rounding_errors(objective, x).gradient / known.curvature
            assert known.distance <= 3.001 * error + 4 * allowed
            assert known.newton_step <= known.distance <= known.unique_within

    @given(seeds, st.floats(-14.0, 0.0))
    def test_of_many_particles_too(self, seed, exponent):
        objective, x = disturbed(seed, exponent, mildly=True)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(certificate, "MANY_PARTICLES", 1)
            known = certify(objective, x)
        if known.covered:
            assert distance_to_minimiser(oracle_of(seed, mildly=True), x) <= known.distance

    def test_it_is_no_idle_bound(self, beside_minimisers):
        """Half of the points are covered, most of them by hardly a fifth too much."""
        ratios = [
            certify(objective, x).distance / error
            for objective, x, error in beside_minimisers
            if 1e-10 < error < np.inf
        ]
        assert np.mean(np.isfinite(ratios)) > 0.5
        assert np.median(ratios) < 1.2

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_fault_in_the_distance_is_seen(self, beside_minimisers, monkeypatch, fault):
        assert not any(is_broken(*point) for point in beside_minimisers)
        monkeypatch.setattr(certificate, *FAULTS[fault])
        assert any(is_broken(*point) for point in beside_minimisers)


def is_broken(objective, x, error):
    """Whether a minimiser is further away than a bound says."""
    return error > certify(objective, x).distance


def oracle_of(seed, *, mildly=False):
    system, state, forces, pins_at, h = random_motion(seed, mildly=mildly)
    return extended_precision.Step(system, state, h, forces, pins_at)


def distance_to_minimiser(oracle, x):
    return extended_precision.norm(oracle.minimiser(x) - extended_precision.wide(x))
