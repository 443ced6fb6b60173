"""How integrators treat the energy: the series, and what is known of it."""

import pytest

from plumbob.crosscheck import samples
from plumbob.crosscheck.mass_spring.integrators import SIMULATORS, energy_series, mechanical_energy


@pytest.mark.parametrize("motion", SIMULATORS)
def test_series_begins_with_the_energy_of_the_start_and_ends_in_time(motion):
    system, state, _, h = samples.smooth(0)
    series = energy_series(SIMULATORS[motion], system, state, h, steps=6, every=3)
    last = SIMULATORS[motion](system, h)(state, None, 6)
    assert series.energies[0] == mechanical_energy(system, state)
    assert series.times == pytest.approx([0.0, 3 * h, 6 * h])
    assert series.energies[2] == pytest.approx(mechanical_energy(system, last))


def test_steps_must_come_out_even():
    system, state, h = samples.oscillator(0)
    with pytest.raises(ValueError, match="steps: expected a multiple of 3, got 7"):
        energy_series(SIMULATORS["Runge-Kutta"], system, state, h, steps=7, every=3)
