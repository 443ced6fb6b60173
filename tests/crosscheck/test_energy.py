"""How integrators treat the energy: the series, and what is known of it."""

import numpy as np
import pytest

from plumbob.crosscheck import samples
from plumbob.crosscheck.mass_spring.integrators import SIMULATORS, energy_series, mechanical_energy

# Steps of an undamped spring, twelve to a radian.
STEPS, SHARE = 600, 1 / 12


def swing(motion):
    """The energy of an undamped oscillator over its first value."""
    system, state, _ = samples.oscillator(0)
    h = SHARE / np.sqrt(system.stiffnesses[0] / system.masses[1])
    energies = energy_series(SIMULATORS[motion], system, state, h, steps=STEPS).energies
    return energies / energies[0]


@pytest.mark.parametrize("motion", SIMULATORS)
def test_series_begins_with_the_energy_of_the_start_and_ends_in_time(motion):
    system, state, _, h = samples.smooth(0)
    series = energy_series(SIMULATORS[motion], system, state, h, steps=6, every=3)
    last = SIMULATORS[motion](system, h)(state, None, 6)
    assert series.energies[0] == mechanical_energy(system, state)
    assert series.times == pytest.approx([0.0, 3 * h, 6 * h])
    assert series.energies[2] == pytest.approx(mechanical_energy(system, last))


@pytest.mark.parametrize("motion", ["symplectic Euler", "MuJoCo Euler", "MuJoCo implicit"])
def test_springs_taken_explicitly_keep_the_energy_in_bounds(motion):
    """Symplectic Euler keeps an energy that differs by h omega / 2 of it at most."""
    energies = swing(motion)
    assert np.ptp(energies) > 0.2 * SHARE
    assert np.abs(energies - energies.mean()).max() < 0.6 * SHARE
    assert energies[-100:].mean() == pytest.approx(energies[:100].mean(), abs=0.1 * SHARE)


def test_implicit_euler_loses_energy_in_every_step():
    energies = swing("implicit Euler")
    assert (np.diff(energies) < 0.0).all()
    assert energies[-1] == pytest.approx((1 + SHARE**2) ** -STEPS)


def test_runge_kutta_loses_little():
    """Of one spring it leaves 1 - (h omega)^6 / 72 + (h omega)^8 / 576 in each step."""
    left = (1 - SHARE**6 / 72 + SHARE**8 / 576) ** STEPS
    for motion in ("Runge-Kutta", "MuJoCo RK4"):
        assert swing(motion)[-1] == pytest.approx(left, rel=1e-12)


def test_steps_must_come_out_even():
    system, state, h = samples.oscillator(0)
    with pytest.raises(ValueError, match="steps: expected a multiple of 3, got 7"):
        energy_series(SIMULATORS["Runge-Kutta"], system, state, h, steps=7, every=3)
