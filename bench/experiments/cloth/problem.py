"""The lab's cloth let go, as it is and stiffer."""

import functools
from dataclasses import dataclass

from plumbob.reference import MassSpring, State, scenes

STIFFNESS = 100.0
FACTORS = (1, 10, 100)
H = 1 / 60
DAMPING = 0.2  # of the lab's own cloth; those that swing here have none unless it is asked for


@dataclass(frozen=True)
class ClothSwing:
    """A cloth that falls from rest and swings, in steps of fixed length.

    Attributes:
        name: of the problem.
        system: particles and springs.
        start: the state it is let go from.
        h: the step [s].
    """

    name: str
    system: MassSpring
    start: State
    h: float


@functools.cache
def cloth_swing(factor: float, size: int = 11, damping: float = 0.0) -> ClothSwing:
    """Return the lab's cloth of size x size particles, `factor` times as stiff."""
    system, start = scenes.lab_cloth(stiffness=factor * STIFFNESS, size=size, damping=damping)
    name = f"cloth/x{factor:g}" if size == 11 else f"cloth/x{factor:g}/{size}x{size}"
    return ClothSwing(name, system, start, H)
