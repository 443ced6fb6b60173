"""The energy of a system over many steps of an integrator."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray, integer
from plumbob.reference.mass_spring import MassSpring, State, kinetic_energy, potential_energy

from .integrators import Simulation


class EnergySeries(NamedTuple):
    """The energy of a system over time."""

    times: FloatArray  # [s], shape (sample,), from zero
    energies: FloatArray  # kinetic and potential [J], shape (sample,)


def energy_series(
    integrator: Callable[[MassSpring, float], Simulation],
    system: MassSpring,
    state: State,
    h: float,
    *,
    steps: int,
    every: int = 1,
) -> EnergySeries:
    """Return the energy at the start and after every `every` steps.

    Args:
        integrator: one of `SIMULATORS`, or a function of the same form.
        system: particles and springs, without external forces.
        state: the initial state.
        h: the step [s].
        steps: number of steps, a multiple of `every`.
        every: steps between two samples.

    Raises:
        ValueError: if `steps` is no multiple of `every`.
    """
    count, rest = divmod(integer("steps", steps, least=1), integer("every", every, least=1))
    if rest:
        raise ValueError(f"steps: expected a multiple of {every}, got {steps}")
    simulate = integrator(system, h)
    energies = [mechanical_energy(system, state)]
    for _ in range(count):
        state = simulate(state, None, every)
        energies.append(mechanical_energy(system, state))
    return EnergySeries(h * every * np.arange(count + 1, dtype=np.float64), np.array(energies))


def mechanical_energy(system: MassSpring, state: State) -> float:
    """Return the kinetic energy plus that of springs and gravity [J]."""
    return kinetic_energy(system, state) + potential_energy(system, state.positions)
