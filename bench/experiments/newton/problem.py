"""Heavy cloths in the middle of their first swing: one step from there is worth solving well."""

import functools
from dataclasses import dataclass

from plumbob.reference import ImplicitEuler, MassSpring, State, scenes

STIFFNESSES = (1e3, 1e4, 1e5)
H = 1 / 30
FRAMES = 15
GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class MidSwing:
    """A cloth in motion, and the step to take from there.

    Attributes:
        system: particles and springs.
        state: half a second after it was let go.
        h: the step [s].
    """

    system: MassSpring
    state: State
    h: float


@functools.cache
def mid_swing(stiffness: float, size: int) -> MidSwing:
    """Return the lab's cloth under real gravity after so many converged frames from rest."""
    system, state = scenes.lab_cloth(size=size, stiffness=stiffness, gravity=GRAVITY)
    integrator = ImplicitEuler(system, h=H)
    for _ in range(FRAMES):
        state = integrator.step(state).state
    return MidSwing(system, state, H)
