"""Whole motions by every integrator, ours and MuJoCo's, and where they agree at any length."""

from collections.abc import Callable, Iterator
from functools import partial

from numpy.typing import ArrayLike

from reference.explicit import runge_kutta, symplectic_euler
from reference.implicit_euler import ImplicitEuler
from reference.mass_spring import MassSpring, State

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison
from .comparing import states

# A motion on: from a state, under constant external forces, by a number of steps.
Motion = Callable[[State, ArrayLike | None, int], State]


def explicit(
    step: Callable[[MassSpring, State, float, ArrayLike | None], State],
    system: MassSpring,
    h: float,
) -> Motion:
    """Return the motion by an explicit integrator of ours."""

    def move(state: State, external_forces: ArrayLike | None, steps: int) -> State:
        for _ in range(steps):
            state = step(system, state, h, external_forces)
        return state

    return move


def implicit(solver: str, system: MassSpring, h: float, *, tolerance: float = 1e-13) -> Motion:
    """Return the motion by implicit Euler, each step solved by one of its solvers."""
    integrator = ImplicitEuler(system, h=h, solver=solver, tolerance=tolerance)

    def move(state: State, external_forces: ArrayLike | None, steps: int) -> State:
        for _ in range(steps):
            state = integrator.step(state, external_forces).state
        return state

    return move


def mujoco(integrator: str, system: MassSpring, h: float) -> Motion:
    """Return the motion by an integrator of MuJoCo's."""
    engine = MujocoMassSpring(system, h=h, integrator=integrator)

    def move(state: State, external_forces: ArrayLike | None, steps: int) -> State:
        return engine.step(state, external_forces, steps=steps)

    return move


MOTIONS: dict[str, Callable[[MassSpring, float], Motion]] = {
    "symplectic Euler": partial(explicit, symplectic_euler),
    "Runge-Kutta": partial(explicit, runge_kutta),
    "implicit Euler": partial(implicit, "newton"),
    "Gauss-Newton": partial(implicit, "gauss_newton"),
    "MuJoCo Euler": partial(mujoco, "Euler"),
    "MuJoCo RK4": partial(mujoco, "RK4"),
    "MuJoCo implicit": partial(mujoco, "implicit"),
    "MuJoCo implicitfast": partial(mujoco, "implicitfast"),
    "MuJoCo discrete": partial(mujoco, "discrete"),
}


def long_motions(ours: str, theirs: str, steps: int, cases: int) -> Iterator[Comparison]:
    """Compare the states after many steps of two integrators that are said to be the same."""
    for case in range(cases):
        system, state, external, h = samples.smooth(case)
        our_end = MOTIONS[ours](system, h)(state, external, steps)
        their_end = MOTIONS[theirs](system, h)(state, external, steps)
        yield states(our_end, their_end, state)
