"""Mass-spring systems: our forces, energies and steps beside MuJoCo's, case by case."""

import functools
from collections.abc import Iterator

import numpy as np

from reference.arguments import FloatArray
from reference.explicit import symplectic_euler
from reference.implicit_euler import ImplicitEuler
from reference.mass_spring import (
    MassSpring,
    State,
    damper_forces,
    kinetic_energy,
    potential_energy,
    spring_forces,
)

from . import samples
from .engines import MujocoMassSpring
from .verdict import Comparison

# Newton's iterations for a balance: all that the hardest case, which needs 13, takes to end in
# rounding. Where they have ended another one changes nothing.
NEWTON_ITERATIONS = 16


def tendon_springs(cases: int) -> Iterator[Comparison]:
    """Compare the springs' forces on the free particles, over the largest."""
    for case in range(cases):
        system, state, _, _ = samples.motion(case)
        ours = spring_forces(system, state.positions)[system.free]
        yield _forces(ours, _engine_at(case).spring_forces())


def tendon_dampers(cases: int) -> Iterator[Comparison]:
    """Compare the dampers' forces on the free particles, over the largest."""
    for case in range(cases):
        system, state, _, _ = samples.motion(case)
        ours = damper_forces(system, state)[system.free]
        yield _forces(ours, _engine_at(case).damper_forces())


def tendon_potential(cases: int) -> Iterator[Comparison]:
    """Compare the energy of springs and gravity, over the sum of its terms' magnitudes."""
    for case in range(cases):
        system, state, _, _ = samples.motion(case)
        engine = _engine_at(case)
        stored = 0.5 * system.stiffnesses * (engine.lengths() - system.rest_lengths) ** 2
        raised = np.abs(system.masses[:, None] * system.gravity * state.positions)
        ours = potential_energy(system, state.positions)
        scale = float(stored.sum() + raised.sum())
        yield _numbers(ours, engine.potential_energy(), scale)


def point_kinetic(cases: int) -> Iterator[Comparison]:
    """Compare the kinetic energy, over itself."""
    for case in range(cases):
        system, state, _, _ = samples.motion(case)
        theirs = _engine_at(case).kinetic_energy()
        yield _numbers(kinetic_energy(system, state), theirs, scale=theirs)


def symplectic_steps(cases: int) -> Iterator[Comparison]:
    """Compare the state after one step of symplectic Euler with one of MuJoCo's Euler."""
    for case in range(cases):
        system, state, external, h = samples.motion(case)
        engine = MujocoMassSpring(system, h=h, integrator="Euler")
        ours = symplectic_euler(system, state, h, external)
        yield _states(ours, engine.step(state, external), state)


def gauss_newton_steps(cases: int, *, damped: bool) -> Iterator[Comparison]:
    """Compare the state after one Gauss-Newton step with one of MuJoCo's discrete."""
    for case in range(cases):
        system, state, external, h = samples.motion(case, damped=damped)
        engine = MujocoMassSpring(system, h=h, integrator="discrete")
        ours = ImplicitEuler(system, h=h, solver="gauss_newton").step(state, external).state
        yield _states(ours, engine.step(state, external), state)


def implicit_balances(cases: int, *, damped: bool) -> Iterator[Comparison]:
    """Compare M (x - y) of our converged step with h² f(x), all forces by MuJoCo at our x.

    Both are taken over |M (x - y)| + h² sum |spring force|.
    """
    for case in range(cases):
        system, state, external, h = samples.motion(case, damped=damped)
        euler = ImplicitEuler(
            system, h=h, solver="newton", tolerance=0.0, max_iterations=NEWTON_ITERATIONS
        )
        x = euler.step(state, external).state.positions
        y = state.positions + h * state.velocities
        inertia = (system.masses[:, None] * (x - y))[system.free]
        forces, tensions = forces_of_the_step(system, state, x, h)
        yield Comparison(
            ours=inertia,
            theirs=h**2 * (forces + external[system.free]),
            still=np.zeros_like(inertia),
            scale=float(np.linalg.norm(inertia) + h**2 * tensions),
        )


def forces_of_the_step(
    system: MassSpring, state: State, x: FloatArray, h: float
) -> tuple[FloatArray, float]:
    """Return MuJoCo's forces at the end x of an implicit step from a state, and their sum's size.

    Springs and gravity are MuJoCo's at x. The damper of the step is not MuJoCo's damper at the
    velocity (x - x_n)/h: that one takes the part of the velocity along the spring as it stands at
    x, and so sees a spring that only turns by a finite angle grow shorter. The damper in E sees
    the length itself, -c (l(x) - l_n)/h: to MuJoCo it is a tendon of stiffness c/h and rest length
    l_n, its own length of the spring at x_n.

    Returns:
        Forces on the free particles [N], shape (free, 3); sum of |force| over all springs [N].
    """
    l_n = _placed(system, state).lengths()
    dampers = MassSpring(
        system.masses, system.springs, l_n, system.dampings / h,
        pinned=system.pinned, gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    end = State(x, np.zeros_like(x))
    springs_at_end, dampers_at_end = _placed(system, end), _placed(dampers, end)
    forces = springs_at_end.spring_forces() + springs_at_end.gravity_forces()
    pulls = _tensions(system, springs_at_end), _tensions(dampers, dampers_at_end)
    return forces + dampers_at_end.spring_forces(), float(np.abs(pulls).sum())


@functools.cache
def _engine_at(case: int) -> MujocoMassSpring:
    """Return the engine with a case's start in it, kept for the claims that only read."""
    system, state, _, _ = samples.motion(case)
    return _placed(system, state)


def _placed(system: MassSpring, state: State) -> MujocoMassSpring:
    engine = MujocoMassSpring(system)
    engine.place(state)
    return engine


def _tensions(system: MassSpring, engine: MujocoMassSpring) -> FloatArray:
    """Return each spring's k (l - r) [N], by MuJoCo's lengths, shape (spring,)."""
    return system.stiffnesses * (engine.lengths() - system.rest_lengths)


def _forces(ours: FloatArray, theirs: FloatArray) -> Comparison:
    return Comparison(ours, theirs, np.zeros_like(theirs), scale=float(np.abs(theirs).max()))


def _numbers(ours: float, theirs: float, scale: float) -> Comparison:
    return Comparison(np.array(ours), np.array(theirs), np.array(0.0), scale)


def _states(ours: State, theirs: State, start: State) -> Comparison:
    """Compare positions over the largest coordinate and velocities over the largest velocity.

    The pinned particles take part.
    """
    length = np.abs(theirs.positions).max()
    speed = np.abs(theirs.velocities).max()

    def row(state: State) -> FloatArray:
        return np.stack([state.positions / length, state.velocities / speed])

    return Comparison(row(ours), row(theirs), row(start), scale=1.0)
