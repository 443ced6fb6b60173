"""Large systems are summed in regions: the same sums, whoever adds them up."""

import numpy as np
import pytest

from plumbob.reference import ImplicitEuler, State, scenes
from plumbob.reference.backend.partition import partition_springs
from plumbob.reference.backend.threads import set_num_threads
from plumbob.reference.implicit_euler.objective import Objective

pytestmark = pytest.mark.both_backends

H = 1 / 30
EPS = np.finfo(float).eps


def cloth(**changes):
    return scenes.grid_cloth(9, 8, **changes)


SYSTEMS = {
    "cloth": cloth,
    "damped": lambda: cloth(damping=0.3),
    "tension-only": lambda: cloth(damping=0.3, tension_only=True),
    "network": lambda: scenes.random_network(3, particles=40),
}


@pytest.fixture(params=SYSTEMS)
def moving(request, rng):
    system, state = SYSTEMS[request.param]()
    x = state.positions + 0.05 * rng.standard_normal(state.positions.shape)
    return system, State(x, rng.standard_normal(x.shape))


@pytest.fixture
def in_regions(moving, monkeypatch):
    """The same system and state, taken for a large one."""
    system, state = moving
    assert system.with_separate_dampers.regions is None
    monkeypatch.setattr("plumbob.reference.mass_spring.LARGE", 1)
    large = system.replaced()
    assert large.with_separate_dampers.regions is not None
    return large, state


@pytest.mark.parametrize("count", [1, 2, 7, 200])
def test_every_spring_is_in_its_region_once(moving, count):
    system, _ = moving
    regions = partition_springs(system.springs, system.particle_count, count)
    assert sorted(regions.order) == list(range(len(system.springs)))
    np.testing.assert_array_equal(regions.springs, system.springs[regions.order])
    assert (regions.particles[0], regions.particles[-1]) == (0, system.particle_count)
    region = np.searchsorted(regions.particles, system.springs[regions.order], side="right") - 1
    for r in range(count):
        assert (region[regions.starts[r] : regions.starts[r + 1]] == r).all()
    assert (region[regions.starts[-1] :, 0] != region[regions.starts[-1] :, 1]).all()


def test_the_sum_over_regions_is_the_sum_over_all(moving, in_regions, rng, backend):
    whole, parts = Objective(*moving, H), Objective(*in_regions, H)
    x = moving[1].positions + 0.1 * rng.standard_normal(moving[1].positions.shape)
    x[1] += 5.0  # the farthest one is not in the last region
    expected, found = whole.evaluate(x), parts.evaluate(x)
    assert abs(found.gradient - expected.gradient).max() <= expected.floor / 64
    assert found.value == pytest.approx(expected.value, rel=0, abs=expected.value_floor)
    assert found.gradient_norm == pytest.approx(expected.gradient_norm, rel=32 * EPS)
    assert found.floor_bound == pytest.approx(expected.floor_bound, rel=32 * EPS)


def test_the_bits_do_not_depend_on_the_cores(in_regions):
    results = []
    for count in (1, 2, 3):
        with set_num_threads(count):
            integrator = ImplicitEuler(in_regions[0], h=H, solver="local_global", max_iterations=5)
            results.append(integrator.step(in_regions[1]))
    for result in results[1:]:
        np.testing.assert_array_equal(result.state.positions, results[0].state.positions)
        np.testing.assert_array_equal(result.objectives, results[0].objectives)
