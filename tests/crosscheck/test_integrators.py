"""The energy over time of each integrator, and how far the end of a step is from balance."""

import numpy as np
import pytest

from plumbob.crosscheck import samples
from plumbob.crosscheck.mass_spring.integrators import SIMULATORS, energy_series, mechanical_energy
from plumbob.crosscheck.mass_spring.steps import balance_residual
from plumbob.crosscheck.tolerances import TOLERANCES
from plumbob.reference.implicit_euler import ImplicitEuler


@pytest.mark.parametrize("motion", SIMULATORS)
def test_series_begins_with_the_energy_of_the_start_and_ends_in_time(motion):
    system, state, _, h = samples.smooth(0)
    series = energy_series(SIMULATORS[motion], system, state, h, steps=6, every=3)
    last = SIMULATORS[motion](system, h)(state, None, 6)
    assert series.energies[0] == mechanical_energy(system, state)
    assert series.times == pytest.approx([0.0, 3 * h, 6 * h])
    assert series.energies[2] == pytest.approx(mechanical_energy(system, last))


def test_moved_pins_are_where_the_step_took_them():
    system, state, external, h = samples.network(0, damped=False)
    pins_at = state.positions[system.pinned] + 0.1
    settings = {"h": h, "tolerance": 1e-14}
    x = ImplicitEuler(system, **settings).step(state, external, pins_at).state.positions
    assert balance_residual(system, state, x, h, external) < TOLERANCES["balance"].value
    x = ImplicitEuler(system, **settings).step(state, external).state.positions
    x = np.where(system.free[:, None], x, x + 0.1)
    assert balance_residual(system, state, x, h, external) > 1e-6
