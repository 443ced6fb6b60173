"""The lab's cloth, falling and swinging in converged steps of implicit Euler."""

import functools
from dataclasses import dataclass
from typing import Any

from plumbob.reference import ImplicitEuler, MassSpring, State, scenes

# The lab's own: [N/m], and a frame [s].
STIFFNESS, H = 100.0, 1 / 60
# The cloth falls for three seconds; the steps of the next second are measured.
FALLING, STEPS = 180, 60
# A step in the middle of the swing.
MIDDLE = FALLING + STEPS // 2
# The default of `ImplicitEuler`.
TOLERANCE = 1e-10


@dataclass(frozen=True)
class ClothSwing:
    """A falling and swinging cloth, in steps of fixed length."""

    name: str  # of the problem
    system: MassSpring
    start: State
    h: float  # the step [s]


@functools.cache
def cloth_swing(factor: float, size: int = 11, damping: float = 0.0) -> ClothSwing:
    """Return the lab's cloth of size x size particles at rest, `factor` times as stiff."""
    system, start = scenes.lab_cloth(stiffness=factor * STIFFNESS, size=size, damping=damping)
    name = f"cloth/x{factor:g}" if size == 11 else f"cloth/x{factor:g}/{size}x{size}"
    return ClothSwing(name, system, start, H)


def integrator_of(
    problem: ClothSwing,
    solver: str = "newton",
    tolerance: float = TOLERANCE,
    max_iterations: int = 100,
) -> ImplicitEuler:
    """Return an integrator of a cloth, by default converged in every step."""
    limits: dict[str, Any] = {"tolerance": tolerance, "max_iterations": max_iterations}
    return ImplicitEuler(problem.system, h=problem.h, solver=solver, **limits)


@functools.cache
def converged_motion(problem: ClothSwing) -> tuple[State, ...]:
    """Return the states of the four seconds by converged steps, the start first."""
    return tuple(motion(problem.start, FALLING + STEPS, integrator_of(problem)))


def motion(start: State, steps: int, integrator: ImplicitEuler) -> list[State]:
    """Return the states of consecutive steps, the start first."""
    states = [start]
    for _ in range(steps):
        states.append(integrator.step(states[-1]).state)
    return states
