"""How integrators treat the energy over many steps."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from reference.arguments import FloatArray, integer
from reference.mass_spring import MassSpring, State, kinetic_energy, potential_energy

from .motions import Motion


class EnergySeries(NamedTuple):
    """The energy of a system along a motion.

    Attributes:
        times: [s], shape (sample,), the start first.
        energies: kinetic and potential [J], shape (sample,).
    """

    times: FloatArray
    energies: FloatArray


def energy_series(
    integrator: Callable[[MassSpring, float], Motion],
    system: MassSpring,
    state: State,
    h: float,
    *,
    steps: int,
    every: int = 1,
) -> EnergySeries:
    """Return the energy at the start and after every so many steps of a motion.

    Args:
        integrator: one of `MOTIONS`, or made like them.
        system: the system that moves, under gravity alone.
        state: its start.
        h: the step [s].
        steps: how many to take, a multiple of `every`.
        every: steps between two samples.

    Raises:
        ValueError: if `steps` is no multiple of `every`.
    """
    count, rest = divmod(integer("steps", steps, least=1), integer("every", every, least=1))
    if rest:
        raise ValueError(f"steps: expected a multiple of {every}, got {steps}")
    move = integrator(system, h)
    energies = [mechanical_energy(system, state)]
    for _ in range(count):
        state = move(state, None, every)
        energies.append(mechanical_energy(system, state))
    return EnergySeries(h * every * np.arange(count + 1, dtype=np.float64), np.array(energies))


def mechanical_energy(system: MassSpring, state: State) -> float:
    """Return the energy of motion, springs and gravity [J]."""
    return kinetic_energy(system, state) + potential_energy(system, state.positions)
