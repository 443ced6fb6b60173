"""Laws of the cache of factors: a factor is shared where it is valid, and only there."""

import gc

import numpy as np
import pytest

from plumbob.reference.implicit_euler import STEP_SOLVERS, ImplicitEuler, factor_cache
from plumbob.reference.sparse import factor

h = 0.05


@pytest.fixture(autouse=True)
def nothing_alive():
    """Start without the factors that other tests may have left to the garbage collector."""
    factor_cache.clear()


@pytest.fixture
def analyses(monkeypatch):
    """Return the list to which every analysis of a pattern adds its number of rows."""
    counted, analyse = [], factor.analyse

    def counting(graph):
        counted.append(len(graph.indptr) - 1)
        return analyse(graph)

    monkeypatch.setattr(factor, "analyse", counting)
    return counted


@pytest.fixture(params=["twice the step", "another pin", "a stiffer spring", "a longer spring"])
def change(request, network, altered):
    """Return another system and step, one thing of the network's changed."""
    system, k, r = network[0], network[0].stiffnesses.copy(), network[0].rest_lengths.copy()
    k[3], r[3] = 2 * k[3], 1.5 * r[3]
    return {
        "twice the step": (system, 2 * h),
        "another pin": (altered(system, pinned=[4]), h),
        "a stiffer spring": (altered(system, stiffnesses=k), h),
        "a longer spring": (altered(system, rest_lengths=r), h),
    }[request.param]


@pytest.mark.sample(every=3)
@pytest.mark.parametrize("solver", STEP_SOLVERS)
def test_a_change_between_steps_gives_what_a_fresh_integrator_gives(network, change, solver):
    before = ImplicitEuler(network[0], h=h, solver=solver)
    state = before.step(network[1]).state
    system, step = change
    after = ImplicitEuler(system, h=step, solver=solver).step(state)
    factor_cache.clear()
    fresh = ImplicitEuler(system, h=step, solver=solver).step(state)
    np.testing.assert_array_equal(after.state.positions, fresh.state.positions)
    np.testing.assert_array_equal(after.history, fresh.history)
    unchanged = before.step(state).state
    assert np.abs(after.state.positions - unchanged.positions).max() > 1e-4


@pytest.mark.parametrize("solver", STEP_SOLVERS)
def test_a_pattern_is_analysed_once(network, altered, analyses, solver):
    system, state = network
    one = ImplicitEuler(system, h=h, solver=solver)
    one.step(one.step(state).state)
    other = ImplicitEuler(altered(system, stiffnesses=2.0), h=2 * h, solver=solver)
    other.step(state)
    assert len(analyses) == 1
    pinned = ImplicitEuler(altered(system, pinned=[4]), h=h, solver=solver)
    pinned.step(state)
    assert len(analyses) == 2


def test_the_same_matrix_is_factorised_once(network):
    one = factor_cache.global_factor(network[0], h)
    assert factor_cache.global_factor(network[0], h) is one
    assert factor_cache.global_factor(network[0], 2 * h) is not one


def test_an_unused_factor_leaves_the_cache(network, analyses):
    for _ in range(2):
        ImplicitEuler(network[0], h=h, solver="local_global")
        gc.collect()
        assert not factor_cache._by_pattern
        assert not factor_cache._by_matrix
    assert len(analyses) == 2
