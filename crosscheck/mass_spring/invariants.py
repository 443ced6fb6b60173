"""Conserved quantities, and the dissipation of implicit Euler in closed form."""

from collections.abc import Sequence

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import MassSpring, State

from .. import samples
from ..verdict import Comparison
from .energy import mechanical_energy
from .integrators import SIMULATORS
from .orders import observed_order

STEPS = 40


def linear_momenta(names: Sequence[str], case: int) -> Comparison:
    """Compare the momentum after many steps with P + t F, relative to the sum of |m v| and |t F|.

    F is the sum of the weights and the external forces; springs and dampers cancel.
    """
    system, state, external, h = samples.unpinned(case)
    impulse = STEPS * h * (system.masses[:, None] * system.gravity + external)
    before = linear_momentum(system, state)
    after = [
        linear_momentum(system, SIMULATORS[name](system, h)(state, external, STEPS))
        for name in names
    ]
    momenta = np.abs(system.masses[:, None] * state.velocities).sum()
    return Comparison(
        ours=np.array(after),
        theirs=np.tile(before + impulse.sum(axis=0), (len(names), 1)),
        baseline=np.tile(before, (len(names), 1)),
        scale=float(momenta + np.abs(impulse).sum()),
    )


def angular_momenta(names: Sequence[str], case: int) -> Comparison:
    """Compare the angular momentum before and after, relative to the sum of |x| |m v|."""
    system, state, external, h = samples.drifting(case)
    ends = [SIMULATORS[name](system, h)(state, external, STEPS) for name in names]
    return Comparison(
        ours=np.array([angular_momentum(system, end) for end in ends]),
        theirs=np.tile(angular_momentum(system, state), (len(names), 1)),
        baseline=np.zeros((len(names), 3)),
        scale=_angular_scale(system, state),
    )


def angular_momentum_orders(name: str, order: int, case: int) -> Comparison:
    """Compare the order in h of the error of the angular momentum with the expected one."""
    errors = [_angular_error(case, name, refinement) for refinement in (1, 2)]
    observed = np.array(observed_order(*errors))
    return Comparison(observed, np.array(float(order)), np.array(0.0), scale=1.0)


def scalar_spring_energies(case: int) -> Comparison:
    """Compare the ratio of the energies of one spring after and before n steps of implicit Euler.

    It is (1 + h² omega²)^-n for a spring of rest length zero, whose force is linear in x.
    """
    system, state, h = samples.oscillator(case)
    omega = np.sqrt(system.stiffnesses[0] / system.masses[1])
    end = SIMULATORS["implicit Euler"](system, h)(state, None, STEPS)
    left = (1.0 + (h * omega) ** 2) ** -STEPS
    ratio = mechanical_energy(system, end) / mechanical_energy(system, state)
    return Comparison(np.array(ratio), np.array(left), np.array(1.0), scale=float(left))


def linear_momentum(system: MassSpring, state: State) -> FloatArray:
    """Return the sum of m v [kg m/s], shape (3,)."""
    return np.sum(system.masses[:, None] * state.velocities, axis=0)


def angular_momentum(system: MassSpring, state: State) -> FloatArray:
    """Return the sum of x × m v [kg m²/s], shape (3,)."""
    return np.sum(np.cross(state.positions, system.masses[:, None] * state.velocities), axis=0)


def _angular_error(case: int, name: str, refinement: int) -> FloatArray:
    system, state, external, h = samples.drifting(case)
    end = SIMULATORS[name](system, h / refinement)(state, external, STEPS * refinement)
    return angular_momentum(system, end) - angular_momentum(system, state)


def _angular_scale(system: MassSpring, state: State) -> float:
    momenta = system.masses * np.linalg.norm(state.velocities, axis=1)
    return float(np.sum(np.linalg.norm(state.positions, axis=1) * momenta))
