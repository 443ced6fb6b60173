"""Comparisons of single explicit, semi-implicit and linearised steps with MuJoCo's."""

import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray
from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State, damping_matrix
from plumbob.reference.mass_spring import forces as all_forces

from .. import samples
from ..verdict import Comparison
from .comparison import engine_of, flex, states


def symplectic_steps(case: int) -> Comparison:
    """Compare the state after one step of symplectic Euler with one of MuJoCo's Euler."""
    system, state, external, h = samples.network(case)
    return _compare_with("Euler", case, symplectic_euler(system, state, h, external))


def flex_steps(case: int) -> Comparison:
    """Compare the state after one step of symplectic Euler with MuJoCo's Euler on a flex."""
    system, state, external, h = samples.uniform(case)
    ours = symplectic_euler(system, state, h, external)
    return states(ours, flex(case).step(state, external), state)


def runge_kutta_steps(case: int) -> Comparison:
    """Compare the state after one step of the classical Runge-Kutta method with MuJoCo's RK4."""
    system, state, external, h = samples.network(case)
    return _compare_with("RK4", case, runge_kutta(system, state, h, external))


def damper_diagonal_steps(case: int) -> Comparison:
    """Compare the step with implicit diag(C) with MuJoCo's implicitfast."""
    system, state, external, h = samples.network(case)
    D = damper_blocks(system, state) * np.eye(3)
    return _compare_with("implicitfast", case, semi_implicit(system, state, h, external, D))


def damper_block_steps(case: int) -> Comparison:
    """Compare the step with implicit 3 x 3 blocks of C with MuJoCo's implicit."""
    system, state, external, h = samples.network(case)
    D = damper_blocks(system, state)
    return _compare_with("implicit", case, semi_implicit(system, state, h, external, D))


def gauss_newton_steps(case: int, *, damped: bool) -> Comparison:
    """Compare the state after one Gauss-Newton step with one of MuJoCo's discrete."""
    system, state, external, h = samples.network(case, damped=damped)
    ours = ImplicitEuler(system, h=h, solver="gauss_newton").step(state, external).state
    return _compare_with("discrete", case, ours, damped=damped)


def semi_implicit(
    system: MassSpring, state: State, h: float, external_forces: ArrayLike, D: FloatArray
) -> State:
    """Return the state after (M + h D) (v' - v) = h f(x, v), x' = x + h v'.

    Springs are explicit; of the dampers, only D (particle, 3, 3) is implicit.
    """
    free = system.free
    M = system.masses[free, None, None] * np.eye(3)
    f = all_forces(system, state, external_forces)[free, :, None]
    v = np.where(free[:, None], state.velocities, 0.0)
    v[free] += np.linalg.solve(M + h * D[free], h * f)[..., 0]
    return State(state.positions + h * v, v)


def damper_blocks(system: MassSpring, state: State) -> FloatArray:
    """Return the 3 x 3 blocks on the diagonal of the damping matrix C, (particle, 3, 3)."""
    C = damping_matrix(system, state.positions).tocoo()
    blocks = np.zeros((system.particle_count, 3, 3))
    same = C.row // 3 == C.col // 3
    np.add.at(blocks, (C.row[same] // 3, C.row[same] % 3, C.col[same] % 3), C.data[same])
    return blocks


def _compare_with(integrator: str, case: int, ours: State, *, damped: bool = True) -> Comparison:
    _, state, external, _ = samples.network(case, damped=damped)
    engine = engine_of(case, damped=damped)
    engine.set_integrator(integrator)
    return states(ours, engine.step(state, external), state)
