"""Equilibria: minima of the potential energy against MuJoCo's damped motion and closed forms."""

import numpy as np

from plumbob.reference import scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison

# A step of length h minimises E + M |x - y|²/(2 h²). The step reduces the distance to the
# equilibrium by (h omega)^-2, less than 1e-5 even for the slowest mode.
LONG_STEP = 1e3
# Three steps leave less than 1e-15 of the distance, by Newton iterations to rounding.
LONG_STEPS, ITERATIONS = 3, 25

# The relaxation in MuJoCo: step [s], drag on each particle [N s/m], number of steps. The motions,
# of 20 and 180 seconds, must come to rest within the tolerances of their claims.
ROPE = (0.005, 0.8, 4000)
CLOTH = (0.03, 1.0, 6000)
# The fall of a cloth, of two seconds: step [s], number of steps.
FALL_STEP, FALL_STEPS = 0.03, 67


def ropes_in_closed_form(case: int) -> Comparison:
    """Compare our equilibrium of a rope with the load of each spring over its stiffness."""
    system, state = rope(case)
    return _compare(equilibrium(system, state), hanging(system, state), state)


def ropes(case: int) -> Comparison:
    """Compare our equilibrium of a rope with the end of MuJoCo's damped motion."""
    system, state = rope(case)
    return _compare(equilibrium(system, state), relaxed(system, state, *ROPE), state)


def cloths(case: int) -> Comparison:
    """Compare our equilibrium of a cloth with the end of MuJoCo's damped motion.

    A cloth has several equilibria: both start from the state after a fall of two seconds.
    """
    system, state = cloth(case)
    return _compare(equilibrium(system, state), relaxed(system, state, *CLOTH), state)


def equilibrium(system: MassSpring, state: State) -> FloatArray:
    """Return an equilibrium near a state, by Newton's method on the potential energy.

    The equilibrium is the limit for long h of an implicit Euler step without velocity, where g
    becomes the energy.
    """
    euler = ImplicitEuler(
        system, h=LONG_STEP, solver="newton", tolerance=0.0, max_iterations=ITERATIONS
    )
    zero = np.zeros_like(state.velocities)
    for _ in range(LONG_STEPS):
        state = State(euler.step(State(state.positions, zero)).state.positions, zero)
    return state.positions


def relaxed(system: MassSpring, state: State, h: float, drag: float, steps: int) -> FloatArray:
    """Return the end of a motion by MuJoCo's Euler with drag on every particle."""
    engine = MujocoMassSpring(system, h=h)
    engine.model.dof_damping[:] = drag
    return engine.step(state, steps=steps).positions


def hanging(system: MassSpring, state: State) -> FloatArray:
    """Return the equilibrium of a rope; springs stretch by the weight below over stiffness."""
    below = np.cumsum(system.masses[:0:-1])[::-1]
    lengths = system.rest_lengths - below * system.gravity[1] / system.stiffnesses
    y = state.positions[0, 1] - np.append(0.0, np.cumsum(lengths))
    return np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=1)


def rope(case: int) -> tuple[MassSpring, State]:
    """Return a vertical rope of 10 particles or more, randomly perturbed."""
    system, state = scenes.hanging_rope(particles=10 + 5 * case)
    perturbation = 0.02 * samples.generator("rope", case).standard_normal(state.positions.shape)
    positions = state.positions + np.where(system.free[:, None], perturbation, 0.0)
    return system, State(positions, state.velocities)


def cloth(case: int) -> tuple[MassSpring, State]:
    """Return a cloth of 5 x 5 particles or more after a fall of two seconds."""
    system, state = scenes.lab_cloth(size=5 + 2 * case, damping=0.2)
    return system, symplectic_euler(system, state, FALL_STEP, steps=FALL_STEPS)


def _compare(actual: FloatArray, expected: FloatArray, start: State) -> Comparison:
    return Comparison(actual, expected, start.positions, scale=float(np.abs(expected).max()))
