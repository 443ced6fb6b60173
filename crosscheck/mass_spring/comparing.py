"""How two mass-spring answers are compared, and the engines that the claims share."""

import functools

import numpy as np

from reference.arguments import FloatArray
from reference.mass_spring import State

from .. import samples
from ..engines import MujocoFlex, MujocoMassSpring
from ..verdict import Comparison


@functools.cache
def engine_of(case: int, *, damped: bool = True) -> MujocoMassSpring:
    """Return the engine of a random motion with its step, built once for all claims.

    Whoever takes it writes a state into it and chooses an integrator.
    """
    system, _, _, h = samples.motion(case, damped=damped)
    return MujocoMassSpring(system, h=h)


def placed(case: int) -> MujocoMassSpring:
    """Return the engine of a random motion, all forces and energies computed at its start."""
    engine = engine_of(case)
    engine.place(samples.motion(case).state)
    return engine


@functools.cache
def flex(case: int) -> MujocoFlex:
    """Return the flex of a motion with springs alike, all computed at its start."""
    system, state, _, h = samples.alike(case)
    engine = MujocoFlex(system, h=h)
    engine.place(state)
    return engine


def forces(ours: FloatArray, theirs: FloatArray) -> Comparison:
    """Compare forces over the largest of theirs."""
    return Comparison(ours, theirs, np.zeros_like(theirs), scale=float(np.abs(theirs).max()))


def numbers(ours: float, theirs: float, scale: float) -> Comparison:
    """Compare two numbers that would be zero if nothing moved."""
    return Comparison(np.array(ours), np.array(theirs), np.array(0.0), scale)


def states(ours: State, theirs: State, start: State) -> Comparison:
    """Compare positions over the largest coordinate and velocities over the largest velocity.

    The pinned particles take part.
    """
    length = np.abs(theirs.positions).max()
    speed = np.abs(theirs.velocities).max()

    def row(state: State) -> FloatArray:
        return np.stack([state.positions / length, state.velocities / speed])

    return Comparison(row(ours), row(theirs), row(start), scale=1.0)
