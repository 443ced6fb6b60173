"""The balance of forces at the end of a step of implicit Euler, with MuJoCo's forces."""

import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison

# The slowest case needs 6 iterations to reach rounding error.
NEWTON_ITERATIONS = 12


def implicit_balances(case: int, *, damped: bool) -> Comparison:
    """Compare M (x - y) of our converged step with h² f(x), with MuJoCo's forces at our x.

    The scale is |M (x - y)| + h² sum |spring force|.
    """
    system, state, external, h = samples.network(case, damped=damped)
    euler = ImplicitEuler(
        system, h=h, solver="newton", tolerance=0.0, max_iterations=NEWTON_ITERATIONS
    )
    return balance(system, state, euler.step(state, external).state.positions, h, external)


def balance_residual(
    system: MassSpring,
    state: State,
    x: FloatArray,
    h: float,
    external_forces: ArrayLike | None = None,
) -> float:
    """Return the relative residual of the balance of forces at the end x of a step, (particle, 3).

    It is |M (x - y) - h² f(x)| / (|M (x - y)| + h² sum |spring force|) over the free particles,
    where f are MuJoCo's forces at x; see `forces_of_the_step` for the dampers.
    """
    sides = balance(system, state, x, h, external_forces)
    return float(np.linalg.norm(sides.ours - sides.theirs) / sides.scale)


def balance(
    system: MassSpring,
    state: State,
    x: FloatArray,
    h: float,
    external_forces: ArrayLike | None = None,
) -> Comparison:
    """Return M (x - y) and h² f(x) by MuJoCo at the end x of a step, for the free particles.

    Pins affect the forces only; x contains their positions at the end of the step.
    """
    y = state.positions + h * state.velocities
    inertia = (system.masses[:, None] * (x - y))[system.free]
    loads = np.zeros_like(x) if external_forces is None else np.asarray(external_forces)
    forces, tensions = forces_of_the_step(system, state, x, h)
    return Comparison(
        ours=inertia,
        theirs=h**2 * (forces + loads[system.free]),
        baseline=np.zeros_like(inertia),
        scale=float(np.linalg.norm(inertia) + h**2 * tensions),
    )


def forces_of_the_step(
    system: MassSpring, state: State, x: FloatArray, h: float
) -> tuple[FloatArray, float]:
    """Return MuJoCo's forces at the end x of an implicit step, and the sum of their magnitudes.

    Springs and gravity are MuJoCo's at x. The damper of the step is -c (l(x) - l_n)/h, a tendon of
    stiffness c/h and rest length l_n in MuJoCo, with l_n its own length of the spring at x_n.
    MuJoCo's damper at the velocity (x - x_n)/h is another one: it takes the component of the
    velocity along the spring at x, which is not zero for a spring that only rotates.

    Returns:
        Forces on the free particles [N], shape (free, 3); sum of |force| over all springs [N].
    """
    dampers = MassSpring(
        system.masses, system.springs, _engine_at(system, state).lengths(), system.dampings / h,
        pinned=system.pinned, gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    forces, tensions = np.zeros((1, 3)), 0.0
    for part in (system, dampers):
        engine = _engine_at(part, State(x, np.zeros_like(x)))
        forces = forces + engine.spring_forces() + engine.gravity_forces()
        pulls = part.stiffnesses * (engine.lengths() - part.rest_lengths)
        tensions += float(np.abs(pulls).sum())
    return forces, tensions


def _engine_at(system: MassSpring, state: State) -> MujocoMassSpring:
    engine = MujocoMassSpring(system)
    engine.update_forces(state)
    return engine
