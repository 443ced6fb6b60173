"""Comparisons of two mass-spring results, and cached engines that the claims share."""

import functools

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import State

from .. import samples
from ..engines import MujocoFlex, MujocoMassSpring
from ..verdict import Comparison


@functools.cache
def engine_of(case: int, *, damped: bool = True) -> MujocoMassSpring:
    """Return the engine of a random network, cached for all claims.

    The caller sets its state and its integrator.
    """
    system, _, _, h = samples.network(case, damped=damped)
    return MujocoMassSpring(system, h=h)


def engine_at_start(case: int) -> MujocoMassSpring:
    """Return the engine of a random network, with forces and energies at its initial state."""
    engine = engine_of(case)
    engine.update_forces(samples.network(case).state)
    return engine


@functools.cache
def flex(case: int) -> MujocoFlex:
    """Return the flex of a uniform network, with forces and energies at its initial state."""
    system, state, _, h = samples.uniform(case)
    engine = MujocoFlex(system, h=h)
    engine.update_forces(state)
    return engine


def forces(ours: FloatArray, theirs: FloatArray) -> Comparison:
    """Compare forces relative to the largest of theirs."""
    return Comparison(ours, theirs, np.zeros_like(theirs), scale=float(np.abs(theirs).max()))


def numbers(ours: float, theirs: float, scale: float) -> Comparison:
    """Compare two numbers whose baseline is zero."""
    return Comparison(np.array(ours), np.array(theirs), np.array(0.0), scale)


def states(ours: State, theirs: State, start: State) -> Comparison:
    """Compare all positions and velocities, relative to the largest of theirs.

    The baseline is the initial state.
    """
    length = np.abs(theirs.positions).max()
    speed = np.abs(theirs.velocities).max()

    def row(state: State) -> FloatArray:
        return np.stack([state.positions / length, state.velocities / speed])

    return Comparison(row(ours), row(theirs), row(start), scale=1.0)
