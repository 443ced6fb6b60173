"""Comparisons of single steps with MuJoCo's: their ends, or the balance of forces there."""

import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray
from plumbob.reference.explicit import runge_kutta, symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import MassSpring, State, damping_matrix
from plumbob.reference.mass_spring import forces as all_forces

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison
from .forces import engine_of, flex

# The slowest case needs 6 iterations to reach rounding error.
NEWTON_ITERATIONS = 12


def explicit_steps(integrator: str, case: int) -> Comparison:
    """Compare a step of symplectic Euler with MuJoCo's Euler, or of Runge-Kutta with its RK4."""
    system, state, external, h = samples.network(case)
    step = runge_kutta if integrator == "RK4" else symplectic_euler
    return _compare_with(integrator, case, step(system, state, h, external))


def flex_steps(case: int) -> Comparison:
    """Compare the state after a step of symplectic Euler with MuJoCo's Euler on a flex."""
    system, state, external, h = samples.uniform(case)
    end = symplectic_euler(system, state, h, external)
    return compare_states(end, flex(case).step(state, external), state)


def damper_steps(integrator: str, case: int) -> Comparison:
    """Compare steps with implicit blocks of C with "implicit", with diag(C) with "implicitfast"."""
    system, state, external, h = samples.network(case)
    D = damper_blocks(system, state)
    D = D * np.eye(3) if integrator == "implicitfast" else D
    return _compare_with(integrator, case, semi_implicit(system, state, h, external, D))


def gauss_newton_steps(damped: bool, case: int) -> Comparison:
    """Compare the state after a Gauss-Newton step with MuJoCo's discrete."""
    system, state, external, h = samples.network(case, damped=damped)
    end = ImplicitEuler(system, h=h, solver="gauss_newton").step(state, external).state
    return _compare_with("discrete", case, end, damped=damped)


def implicit_balances(damped: bool, case: int) -> Comparison:
    """Compare M (x - y) of our converged step with h² f(x), with MuJoCo's forces at our x.

    The scale is |M (x - y)| + h² sum |spring force|.
    """
    system, state, external, h = samples.network(case, damped=damped)
    euler = ImplicitEuler(
        system, h=h, solver="newton", tolerance=0.0, max_iterations=NEWTON_ITERATIONS
    )
    return _balance(system, state, euler.step(state, external).state.positions, h, external)


def balance_residual(
    system: MassSpring,
    state: State,
    x: FloatArray,
    h: float,
    external_forces: ArrayLike | None = None,
) -> float:
    """Return the relative residual of the balance of forces at the end x of a step, (particle, 3).

    The residual is |M (x - y) - h² f(x)| / (|M (x - y)| + h² sum |spring force|) over the free
    particles. f are MuJoCo's forces at x; see `_forces_at_end` for the dampers. Pins affect the
    forces only; x contains their positions at the end of the step.
    """
    inertia, impulse, _, scale = _balance(system, state, x, h, external_forces)
    return float(np.linalg.norm(inertia - impulse) / scale)


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


def compare_states(actual: State, expected: State, start: State) -> Comparison:
    """Compare all positions and velocities, relative to the largest expected."""
    scales = [[[np.abs(expected.positions).max()]], [[np.abs(expected.velocities).max()]]]
    actual_rows, expected_rows, start_rows = (
        np.stack([state.positions, state.velocities]) / scales
        for state in (actual, expected, start)
    )
    return Comparison(actual_rows, expected_rows, start_rows, scale=1.0)


def _compare_with(integrator: str, case: int, end: State, *, damped: bool = True) -> Comparison:
    _, state, external, _ = samples.network(case, damped=damped)
    engine = engine_of(case, damped=damped)
    engine.set_integrator(integrator)
    return compare_states(end, engine.step(state, external), state)


def _balance(
    system: MassSpring, state: State, x: FloatArray, h: float, external_forces: ArrayLike | None
) -> Comparison:
    """Compare M (x - y) and h² f(x) by MuJoCo at the end x of a step, for the free particles."""
    y = state.positions + h * state.velocities
    inertia = (system.masses[:, None] * (x - y))[system.free]
    loads = np.zeros_like(x) if external_forces is None else np.asarray(external_forces)
    forces, tension = _forces_at_end(system, state, x, h)
    return Comparison(
        inertia,
        h**2 * (forces + loads[system.free]),
        baseline=np.zeros_like(inertia),
        scale=float(np.linalg.norm(inertia) + h**2 * tension),
    )


def _forces_at_end(
    system: MassSpring, state: State, x: FloatArray, h: float
) -> tuple[FloatArray, float]:
    """Return MuJoCo's forces at the end x of an implicit step [N], (free, 3), and all tension [N].

    Springs and gravity are MuJoCo's at x. The damper of the step is -c (l(x) - l_n)/h: in MuJoCo a
    tendon of stiffness c/h and rest length l_n, MuJoCo's length of the spring at x_n. MuJoCo's
    damper at the velocity (x - x_n)/h differs. Its velocity is the component along the spring at x,
    not zero for a spring that only rotates.
    """
    dampers = MassSpring(
        system.masses,
        system.springs,
        _engine_at(system, state).lengths(),
        system.dampings / h,
        pinned=system.pinned,
        gravity=(0.0, 0.0, 0.0),
    )
    forces, tension = np.zeros((1, 3)), 0.0
    for springs in (system, dampers):
        engine = _engine_at(springs, State(x, np.zeros_like(x)))
        forces = forces + engine.spring_forces() + engine.gravity_forces()
        stretch = np.abs(engine.lengths() - springs.rest_lengths)
        tension += float((springs.stiffnesses * stretch).sum())
    return forces, tension


def _engine_at(system: MassSpring, state: State) -> MujocoMassSpring:
    engine = MujocoMassSpring(system)
    engine.update_forces(state)
    return engine
