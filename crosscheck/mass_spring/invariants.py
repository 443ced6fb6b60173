"""Closed forms: what the motions of any right integrator keep, and what implicit Euler loses."""

from collections.abc import Iterator, Sequence

import numpy as np

from reference.arguments import FloatArray
from reference.mass_spring import MassSpring, State

from .. import samples
from ..verdict import Comparison
from .energy import mechanical_energy
from .motions import MOTIONS
from .orders import observed_order

STEPS = 40


def linear_momenta(names: Sequence[str], cases: int) -> Iterator[Comparison]:
    """Compare the momentum after many steps with P + t F, over the sum of all |m v| and |t F|.

    F is the sum of the weights and the external forces: springs and dampers give nothing to it.
    """
    for case in range(cases):
        system, state, external, h = samples.unpinned(case)
        push = STEPS * h * (system.masses[:, None] * system.gravity + external)
        before = linear_momentum(system, state)
        after = [
            linear_momentum(system, MOTIONS[name](system, h)(state, external, STEPS))
            for name in names
        ]
        carried = np.abs(system.masses[:, None] * state.velocities).sum()
        yield Comparison(
            ours=np.array(after),
            theirs=np.tile(before + push.sum(axis=0), (len(names), 1)),
            still=np.tile(before, (len(names), 1)),
            scale=float(carried + np.abs(push).sum()),
        )


def angular_momenta(names: Sequence[str], cases: int) -> Iterator[Comparison]:
    """Compare the angular momentum after many steps with that before, over the sum of |x| |m v|."""
    for case in range(cases):
        system, state, external, h = samples.drifting(case)
        ends = [MOTIONS[name](system, h)(state, external, STEPS) for name in names]
        yield Comparison(
            ours=np.array([angular_momentum(system, end) for end in ends]),
            theirs=np.tile(angular_momentum(system, state), (len(names), 1)),
            still=np.zeros((len(names), 3)),
            scale=_turning(system, state),
        )


def angular_momentum_orders(name: str, order: int, cases: int) -> Iterator[Comparison]:
    """Compare the order of h at which the angular momentum strays with the one expected."""
    for case in range(cases):
        observed = np.array(observed_order(_strayed(case, name, 1), _strayed(case, name, 2)))
        yield Comparison(observed, np.array(float(order)), np.array(0.0), scale=1.0)


def scalar_spring_energies(cases: int) -> Iterator[Comparison]:
    """Compare the energy of one spring after many steps with (1 + h² omega²)^-n times the first.

    The spring has no rest length, and so is linear in space.
    """
    for case in range(cases):
        system, state, h = samples.oscillator(case)
        omega = np.sqrt(system.stiffnesses[0] / system.masses[1])
        end = MOTIONS["implicit Euler"](system, h)(state, None, STEPS)
        left = (1.0 + (h * omega) ** 2) ** -STEPS
        ratio = mechanical_energy(system, end) / mechanical_energy(system, state)
        yield Comparison(np.array(ratio), np.array(left), np.array(1.0), scale=float(left))


def linear_momentum(system: MassSpring, state: State) -> FloatArray:
    """Return the sum of m v [kg m/s], shape (3,)."""
    return np.sum(system.masses[:, None] * state.velocities, axis=0)


def angular_momentum(system: MassSpring, state: State) -> FloatArray:
    """Return the sum of x × m v [kg m²/s], shape (3,)."""
    return np.sum(np.cross(state.positions, system.masses[:, None] * state.velocities), axis=0)


def _strayed(case: int, name: str, halved: int) -> FloatArray:
    system, state, external, h = samples.drifting(case)
    end = MOTIONS[name](system, h / halved)(state, external, STEPS * halved)
    return angular_momentum(system, end) - angular_momentum(system, state)


def _turning(system: MassSpring, state: State) -> float:
    reach = np.linalg.norm(state.positions, axis=1)
    carried = system.masses * np.linalg.norm(state.velocities, axis=1)
    return float(np.sum(reach * carried))
