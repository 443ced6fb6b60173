"""Simulations of many steps by our integrators and MuJoCo's, and comparisons of the results."""

from collections.abc import Callable
from functools import partial

from numpy.typing import ArrayLike

from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison
from .comparison import states

# Returns the state after a number of steps from a state under constant external forces.
Simulation = Callable[[State, ArrayLike | None, int], State]


def _repeated(step: Callable[[State, ArrayLike | None], State]) -> Simulation:
    def simulate(state: State, external_forces: ArrayLike | None, steps: int) -> State:
        for _ in range(steps):
            state = step(state, external_forces)
        return state

    return simulate


def explicit(
    step: Callable[[MassSpring, State, float, ArrayLike | None], State],
    system: MassSpring,
    h: float,
) -> Simulation:
    """Return the simulation by one of our explicit integrators."""
    return _repeated(lambda state, loads: step(system, state, h, loads))


def implicit(solver: str, system: MassSpring, h: float, *, tolerance: float = 1e-13) -> Simulation:
    """Return the simulation by implicit Euler with one of its solvers."""
    integrator = ImplicitEuler(system, h=h, solver=solver, tolerance=tolerance)
    return _repeated(lambda state, loads: integrator.step(state, loads).state)


def mujoco(integrator: str, system: MassSpring, h: float) -> Simulation:
    """Return the simulation by one of MuJoCo's integrators."""
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


def long_simulations(ours: str, theirs: str, steps: int, case: int) -> Comparison:
    """Compare the states after many steps of two integrators of the same method."""
    system, state, external, h = samples.smooth(case)
    one, other = (SIMULATORS[name](system, h)(state, external, steps) for name in (ours, theirs))
    return states(one, other, state)
