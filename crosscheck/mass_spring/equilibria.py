"""At rest: the least of the potential energy, by us, by MuJoCo's own relaxation, in closed form."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from reference import scenes
from reference.arguments import FloatArray
from reference.explicit import symplectic_euler
from reference.implicit_euler import ImplicitEuler
from reference.mass_spring import MassSpring, State

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison

# A step of length h minimises E + M |x - y|²/(2 h²): of the distance to the rest, each leaves
# (h omega)^-2, less than a hundred-thousandth even of the slowest motion.
LONG_STEP = 1e3
LONG_STEPS, ITERATIONS = 3, 25


class Relaxation(NamedTuple):
    """How a scene comes to rest in MuJoCo: step [s], drag on each particle [N s/m], steps."""

    h: float
    drag: float
    steps: int


ROPE = Relaxation(h=0.005, drag=0.8, steps=4000)
CLOTH = Relaxation(h=0.03, drag=1.0, steps=6000)
FALLING = 67


def ropes_in_closed_form(cases: int) -> Iterator[Comparison]:
    """Compare our resting rope with the sum of each spring's load over its stiffness."""
    for case in range(cases):
        system, state = rope(case)
        yield _rests(equilibrium(system, state), hanging(system, state), state)


def ropes(cases: int) -> Iterator[Comparison]:
    """Compare our resting rope with the one that MuJoCo lets swing out."""
    for case in range(cases):
        system, state = rope(case)
        yield _rests(equilibrium(system, state), relaxed(system, state, ROPE), state)


def cloths(cases: int) -> Iterator[Comparison]:
    """Compare our resting cloth with the one that MuJoCo lets swing out.

    A cloth has more than one rest: both begin where it has fallen for two seconds.
    """
    for case in range(cases):
        system, state = cloth(case)
        yield _rests(equilibrium(system, state), relaxed(system, state, CLOTH), state)


def equilibrium(system: MassSpring, state: State) -> FloatArray:
    """Return the positions at rest near a state, by Newton on the potential energy.

    It is implicit Euler's step without velocity in the limit of long h, where the energy is all
    that remains of g.
    """
    euler = ImplicitEuler(
        system, h=LONG_STEP, solver="newton", tolerance=0.0, max_iterations=ITERATIONS
    )
    still = np.zeros_like(state.velocities)
    for _ in range(LONG_STEPS):
        state = State(euler.step(State(state.positions, still)).state.positions, still)
    return state.positions


def relaxed(system: MassSpring, state: State, relaxation: Relaxation) -> FloatArray:
    """Return where MuJoCo's Euler comes to rest under a drag on every particle."""
    engine = MujocoMassSpring(system, h=relaxation.h)
    engine.model.dof_damping[:] = relaxation.drag
    return engine.step(state, steps=relaxation.steps).positions


def hanging(system: MassSpring, state: State) -> FloatArray:
    """Return the rope at rest: spring i is longer by the weight below it over its stiffness."""
    below = np.cumsum(system.masses[:0:-1])[::-1]
    lengths = system.rest_lengths - below * system.gravity[1] / system.stiffnesses
    y = state.positions[0, 1] - np.append(0.0, np.cumsum(lengths))
    return np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=1)


def rope(case: int) -> tuple[MassSpring, State]:
    """Return a vertical rope of 10 particles or more, shaken."""
    system, state = scenes.hanging_rope(particles=10 + 5 * case)
    aside = 0.02 * samples.generator("rope", case).standard_normal(state.positions.shape)
    shaken = state.positions + np.where(system.free[:, None], aside, 0.0)
    return system, State(shaken, state.velocities)


def cloth(case: int) -> tuple[MassSpring, State]:
    """Return a cloth of 5 x 5 particles or more that has fallen for two seconds."""
    system, state = scenes.lab_cloth(size=5 + 2 * case, damping=0.2)
    for _ in range(FALLING):
        state = symplectic_euler(system, state, CLOTH.h)
    return system, state


def _rests(ours: FloatArray, theirs: FloatArray, start: State) -> Comparison:
    return Comparison(ours, theirs, start.positions, scale=float(np.abs(theirs).max()))
