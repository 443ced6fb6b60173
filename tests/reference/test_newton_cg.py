"""Laws of Newton's method by conjugate gradients: the product, the preconditioner, its range."""

import gc
import itertools

import numpy as np
import pytest

from plumbob.reference import scenes
from plumbob.reference.implicit_euler import ImplicitEuler, factor_cache
from plumbob.reference.implicit_euler.newton_cg import NewtonCG, _blocks, _product
from plumbob.reference.mass_spring import State, lengths
from plumbob.reference.outcome import Outcome

h = 0.05


@pytest.fixture
def cloth():
    """A 5 x 5 cloth with dampers, swinging fast."""
    system, state = scenes.lab_cloth(size=5, damping=0.2)
    v = np.cross(state.positions - state.positions[0], [0.3, 0.5, 2.0])
    return system, State(state.positions, v)


@pytest.mark.both_backends
@pytest.mark.parametrize("coincident", [False, True])
def test_the_product_is_that_with_the_exact_hessian(network, altered, coincident, backend, rng):
    """Springs of every kind: compressed, slack, coincident, without rest length, damped."""
    system, state = network
    if coincident:
        x, r = state.positions.copy(), system.rest_lengths.copy()
        r[[1, 4]] = 0.0
        for s in (4, 7):
            i, j = system.springs[s]
            x[i] = x[j]
        system, state = altered(system, rest_lengths=r), State(x, state.velocities)
    objective = ImplicitEuler(system, h=h).objective(state)
    effective, x = objective.effective, objective.x_n
    length, r = lengths(effective, x), effective.rest_lengths
    assert ((length < r) & ~effective.tension_only & (length > 0)).any()
    assert (length == 0).any() == coincident
    p, Hp = rng.standard_normal(x.shape), np.empty(x.shape)
    p[system.pinned] = 0.0
    blocks = np.empty((len(r), 4))
    _blocks(x, h * h, effective.arrays, blocks)
    arrays = effective.arrays
    curvature = _product(blocks, p, arrays.masses, arrays.springs, arrays.pinned, Hp)
    expected = (objective.hessian(x) @ p.ravel()).reshape(-1, 3)
    # Twenty roundings of terms of a few kg m.
    np.testing.assert_allclose(Hp, expected, rtol=0, atol=1e-14)
    assert curvature == pytest.approx(float(np.sum(p * expected)), rel=0, abs=1e-13)
    assert np.abs(Hp - system.masses[:, None] * p).max() > 0.1


@pytest.mark.both_backends
@pytest.mark.parametrize("scene", ["cloth", "network"])
def test_single_precision_of_the_preconditioner_does_not_show(
    cloth, network, scene, backend, monkeypatch
):
    """Iterates differ by single precision's rounding error of their CG steps."""
    system, state = cloth if scene == "cloth" else network
    results, steps = [], []
    for single in (True, False):
        monkeypatch.setattr(NewtonCG, "single_precision", single)
        integrator = ImplicitEuler(system, h=h, solver="newton_cg", tolerance=1e-12)
        assert integrator._solver._factor._values.itemsize == (4 if single else 8)
        results.append(integrator.step(state))
        iterates = itertools.islice(integrator.iterates(state), results[-1].iterations + 1)
        steps.append(np.array([iterate.positions for iterate in iterates]))
    assert results[0].outcome == results[1].outcome == Outcome.CONVERGED
    assert results[0].iterations == results[1].iterations
    np.testing.assert_allclose(steps[0], steps[1], rtol=0, atol=1e-6 * np.abs(steps).max())
    assert not np.array_equal(steps[0], steps[1])
    np.testing.assert_allclose(steps[0][-1], steps[1][-1], rtol=0, atol=1e-13)


@pytest.mark.both_backends
@pytest.mark.parametrize(("unit", "itemsize"), [(1e-70, 8), (1e-50, 4), (1e60, 4)])
def test_any_unit_of_mass_gives_the_same_step(network, altered, backend, unit, itemsize):
    """Where L leaves the range of single precision, it stays in double precision."""
    system, state = network
    ends = []
    for factor in (1.0, unit):
        names = ["masses", "stiffnesses", "dampings"]
        scaled = altered(system, **{name: getattr(system, name) * factor for name in names})
        integrator = ImplicitEuler(scaled, h=h, solver="newton_cg")
        result = integrator.step(state)
        assert result.outcome == Outcome.CONVERGED
        ends.append(result.state.positions)
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-9)  # both residuals are below 1e-10
    assert integrator._solver._factor._values.itemsize == itemsize


def test_the_factor_takes_half_the_memory(cloth):
    system, _ = cloth
    factor_cache.clear()
    integrator = ImplicitEuler(system, h=h, solver="newton_cg")
    gc.collect()
    (factor,) = factor_cache._by_matrix.values()
    assert list(factor_cache._by_pattern.values()) == [factor]
    assert factor._values.nbytes == 4 * factor.entries
    assert ImplicitEuler(system, h=h, solver="newton_cg")._solver._factor is factor
    exact = ImplicitEuler(system, h=h, solver="local_global")._solver._factor
    assert exact._values.nbytes == 8 * factor.entries
    assert exact.pattern is factor.pattern
    assert integrator._solver._factor is factor


def test_a_step_is_not_changed_by_the_next(cloth):
    """The vectors of a step are used again by the next step."""
    system, state = cloth
    iterates = ImplicitEuler(system, h=h, solver="newton_cg").iterates(state)
    first, second = next(iterates), next(iterates)
    copies = [first.positions.copy(), second.positions.copy(), second.gradient.copy()]
    third = next(iterates)
    assert np.abs(third.positions - second.positions).max() > 1e-6
    for copy, array in zip(
        copies, [first.positions, second.positions, second.gradient], strict=True
    ):
        np.testing.assert_array_equal(array, copy)
