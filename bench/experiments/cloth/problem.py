"""The lab's cloth let go, as it is and stiffer, and in the middle of its first swing."""

import functools
from dataclasses import dataclass

from plumbob.reference import ImplicitEuler, MassSpring, State, scenes

STIFFNESS = 100.0
FACTORS = (1, 10, 100)
H = 1 / 60
DAMPING = 0.2  # of the lab's own cloth; those that swing here have none unless it is asked for
# Heavy cloths [N/m, m/s²], and how they get to the middle of a swing: in frames of so long [s].
HEAVY_STIFFNESSES = (1e3, 1e4, 1e5)
GRAVITY = 9.81
FRAME, FRAMES = 1 / 30, 15


@dataclass(frozen=True)
class ClothSwing:
    """A cloth that falls and swings, in steps of fixed length.

    Attributes:
        name: of the problem.
        system: particles and springs.
        start: the state from which steps are taken.
        h: the step [s].
    """

    name: str
    system: MassSpring
    start: State
    h: float


@functools.cache
def cloth_swing(factor: float, size: int = 11, damping: float = 0.0) -> ClothSwing:
    """Return the lab's cloth of size x size particles at rest, `factor` times as stiff."""
    system, start = scenes.lab_cloth(stiffness=factor * STIFFNESS, size=size, damping=damping)
    name = f"cloth/x{factor:g}" if size == 11 else f"cloth/x{factor:g}/{size}x{size}"
    return ClothSwing(name, system, start, H)


@functools.cache
def mid_swing(stiffness: float, size: int) -> ClothSwing:
    """Return the lab's cloth under real gravity after so many converged frames from rest."""
    system, state = scenes.lab_cloth(size=size, stiffness=stiffness, gravity=GRAVITY)
    integrator = ImplicitEuler(system, h=FRAME)
    for _ in range(FRAMES):
        state = integrator.step(state).state
    return ClothSwing(f"swing/k{stiffness:g}", system, state, FRAME)
