"""Simulations of many steps by our integrators and MuJoCo's, their ends and their energies."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray, integer
from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State, kinetic_energy, potential_energy

from .. import samples
from ..engines import MujocoMassSpring
from ..engines.mujoco_mass_spring import JOINTS, MujocoJointChain
from ..verdict import Comparison
from .steps import compare_states

# Steps of a chain on a line, and the residual of each: a few rounding errors.
LINE_STEPS, LINE_TOLERANCE = 100, 1e-14

# Returns the state after a number of steps from a state under constant external forces.
Simulation = Callable[[State, ArrayLike | None, int], State]


def explicit(integrator: Callable[..., State], system: MassSpring, h: float) -> Simulation:
    """Return the simulation by an explicit integrator of ours."""
    return lambda state, loads, steps: integrator(system, state, h, loads, steps=steps)


def implicit(solver: str, system: MassSpring, h: float, *, tolerance: float = 1e-13) -> Simulation:
    """Return the simulation by implicit Euler and a solver."""
    integrator = ImplicitEuler(system, h=h, solver=solver, tolerance=tolerance)

    def simulate(state: State, external_forces: ArrayLike | None, steps: int) -> State:
        for _ in range(steps):
            state = integrator.step(state, external_forces).state
        return state

    return simulate


def mujoco(integrator: str, system: MassSpring, h: float) -> Simulation:
    """Return the simulation by an integrator of MuJoCo."""
    engine = MujocoMassSpring(system, h=h, integrator=integrator)
    return lambda state, loads, steps: engine.step(state, loads, steps=steps)


SIMULATORS: dict[str, Callable[[MassSpring, float], Simulation]] = {
    "symplectic Euler": partial(explicit, symplectic_euler),
    "Runge-Kutta": partial(explicit, runge_kutta),
    "implicit Euler": partial(implicit, "newton"),
    "Gauss-Newton": partial(implicit, "gauss_newton"),
    **{
        f"MuJoCo {name}": partial(mujoco, name)
        for name in ("Euler", "RK4", "implicit", "implicitfast", "discrete")
    },
}


def compare_long_runs(integrator: str, counterpart: str, steps: int, case: int) -> Comparison:
    """Compare the states after many steps of two integrators of the same method."""
    system, state, external, h = samples.smooth(case)
    actual, expected = (
        SIMULATORS[name](system, h)(state, external, steps) for name in (integrator, counterpart)
    )
    return compare_states(actual, expected, state)


def joint_chains(case: int) -> Comparison:
    """Compare 100 steps of implicit Euler with nested slides and nested hinges.

    On a line springs are linear and MuJoCo's discrete equals implicit Euler. Positions and
    velocities are relative to the largest of each.
    """
    system, state, external, h = samples.line(case)
    end = implicit("newton", system, h, tolerance=LINE_TOLERANCE)(state, external, LINE_STEPS)
    chains = [MujocoJointChain(system, h=h, joint=joint) for joint in JOINTS]
    expected = np.array([chain.step(state, external, steps=LINE_STEPS) for chain in chains])
    scales = np.abs(expected).max(axis=(0, 2))[:, None]
    actual, start = (
        np.tile([s.positions[:, 0], s.velocities[:, 0]], (len(JOINTS), 1, 1)) for s in (end, state)
    )
    return Comparison(actual / scales, expected / scales, start / scales, scale=1.0)


class EnergySeries(NamedTuple):
    """The energy of a system over time."""

    times: FloatArray  # [s], shape (sample,), from zero
    energies: FloatArray  # kinetic and potential [J], shape (sample,)


def energy_series(
    integrator: Callable[[MassSpring, float], Simulation],
    system: MassSpring,
    state: State,
    h: float,
    *,
    steps: int,
    every: int = 1,
) -> EnergySeries:
    """Return the energy at the start and after every `every` steps of h [s], without loads.

    `integrator` is a value of `SIMULATORS` or a similar function; raise a ValueError if `steps` is
    no multiple of `every`.
    """
    count, remainder = divmod(
        integer("steps", steps, minimum=1), integer("every", every, minimum=1)
    )
    if remainder:
        raise ValueError(f"steps: expected a multiple of {every}, got {steps}")
    simulate = integrator(system, h)
    energies = [mechanical_energy(system, state)]
    for _ in range(count):
        state = simulate(state, None, every)
        energies.append(mechanical_energy(system, state))
    return EnergySeries(h * every * np.arange(count + 1, dtype=np.float64), np.array(energies))


def mechanical_energy(system: MassSpring, state: State) -> float:
    """Return the kinetic energy plus the energy of springs and gravity [J]."""
    return kinetic_energy(system, state) + potential_energy(system, state.positions)
