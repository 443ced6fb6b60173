"""A small cloth that swings for long, with dampers and without."""

import functools
from dataclasses import dataclass

from plumbob.crosscheck.mass_spring.energy import mechanical_energy
from plumbob.crosscheck.mass_spring.equilibria import equilibrium
from plumbob.reference import MassSpring, State, scenes, symplectic_euler

H = 1 / 60
SIZE = 5
DAMPINGS = {"undamped": 0.0, "damped": 0.2}
# Steps after which the cloth hangs well below where it began, near its rest.
FALLING = 120


@dataclass(frozen=True)
class LongSwing:
    """A cloth that is let go, and the energy it has at rest.

    Attributes:
        system: particles and springs.
        start: the state it is let go from.
        rest: the least energy near the start's fall [J].
    """

    system: MassSpring
    start: State
    rest: float


@functools.cache
def long_swing(name: str) -> LongSwing:
    """Return the lab's cloth of few particles, damped or not."""
    system, start = scenes.lab_cloth(size=SIZE, damping=DAMPINGS[name])
    state = start
    for _ in range(FALLING):
        state = symplectic_euler(system, state, H)
    low = equilibrium(system, state)
    rest = mechanical_energy(system, State(low, 0.0 * low))
    return LongSwing(system, start, rest)
