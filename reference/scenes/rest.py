"""Systems at rest: every rest length equals the initial length of its spring exactly."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import FloatArray, IndexArray, number
from ..mass_spring import MassSpring, State, lengths


def at_rest(
    positions: FloatArray,
    springs: IndexArray,
    *,
    masses: FloatArray,
    stiffnesses: ArrayLike,
    damping: float,
    pinned: ArrayLike,
    gravity: float,
    tension_only: ArrayLike = False,
) -> tuple[MassSpring, State]:
    """Return a system at rest at its positions, with one damping and gravity downwards."""
    system = MassSpring(
        masses=masses,
        springs=springs,
        rest_lengths=0.0,
        stiffnesses=stiffnesses,
        dampings=number("damping", damping, least=0),
        pinned=pinned,
        gravity=(0.0, -number("gravity", gravity), 0.0),
        tension_only=tension_only,
    )
    state = State(positions, np.zeros_like(positions))
    return system.replaced(rest_lengths=lengths(system, positions)), state
