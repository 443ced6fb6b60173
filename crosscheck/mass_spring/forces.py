"""Comparisons of forces, energies and stiffness with MuJoCo's tendons and flex edges."""

import functools

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import (
    State,
    damper_forces,
    kinetic_energy,
    potential_energy,
    spring_forces,
    stiffness_matrix,
)

from .. import samples
from ..engines import MujocoFlex, MujocoMassSpring
from ..verdict import Comparison

# Central differences of order 6: offsets in steps, and weights.
OFFSETS = np.array([-3, -2, -1, 1, 2, 3])
WEIGHTS = np.array([-1, 9, -45, 45, -9, 1]) / 60.0  # exact for polynomials of degree 6
# The step [m]: of a spring of 0.1 m the difference is off by (5e-3)**6 = 2e-14, and rounding adds
# about EPS / 5e-4 = 4e-13.
DIFFERENCE_STEP = 5e-4


@functools.cache
def engine_of(case: int, *, damped: bool = True) -> MujocoMassSpring:
    """Return the engine of a random network, cached for all claims, which set its state."""
    system, _, _, h = samples.network(case, damped=damped)
    return MujocoMassSpring(system, h=h)


@functools.cache
def flex(case: int) -> MujocoFlex:
    """Return the flex of a uniform network, with forces and energies at its initial state."""
    system, state, _, h = samples.uniform(case)
    engine = MujocoFlex(system, h=h)
    engine.update_forces(state)
    return engine


def tendon_forces(elements: str, case: int) -> Comparison:
    """Compare the forces of "springs" or "dampers" on the free particles."""
    system, state, _, _ = samples.network(case)
    engine = _engine_at_start(case)
    if elements == "springs":
        actual, expected = spring_forces(system, state.positions), engine.spring_forces()
    else:
        actual, expected = damper_forces(system, state), engine.damper_forces()
    return _compare_forces(actual[system.free], expected)


def tendon_stiffness(case: int) -> Comparison:
    """Compare K times a direction with differences of MuJoCo's forces in the same direction.

    Cases in which the ends of a spring coincide are left out: its force has no derivative there.
    """
    smooth = case + (case + 3) // 4  # 0, 2, 3, 4, 5, 7, ...
    system, state, along, _ = samples.network(smooth)
    d = np.where(system.free[:, None], along, 0.0)
    engine, pulls = engine_of(smooth), []
    for offset in OFFSETS * DIFFERENCE_STEP:
        engine.update_forces(State(state.positions + offset * d, state.velocities))
        pulls.append(engine.spring_forces())
    expected = -np.tensordot(WEIGHTS, pulls, 1) / DIFFERENCE_STEP
    actual = (stiffness_matrix(system, state.positions) @ d.ravel()).reshape(-1, 3)
    return _compare_forces(actual[system.free], expected)


def tendon_potential(case: int) -> Comparison:
    """Compare the energy of springs and gravity, relative to the sum of its terms' magnitudes."""
    return _compare_potential(samples.network(case), _engine_at_start(case))


def point_kinetic(case: int) -> Comparison:
    """Compare the kinetic energy, relative to itself."""
    system, state, _, _ = samples.network(case)
    expected = _engine_at_start(case).kinetic_energy()
    return _compare_numbers(kinetic_energy(system, state), expected, scale=expected)


def flex_forces(case: int) -> Comparison:
    """Compare the forces of springs and dampers with the edges of a flex."""
    system, state, _, _ = samples.uniform(case)
    actual = spring_forces(system, state.positions) + damper_forces(system, state)
    engine = flex(case)
    return _compare_forces(actual[system.free], engine.spring_forces() + engine.damper_forces())


def flex_potential(case: int) -> Comparison:
    """Compare the energy of springs and gravity with a flex's, like `tendon_potential`."""
    return _compare_potential(samples.uniform(case), flex(case))


def _engine_at_start(case: int) -> MujocoMassSpring:
    """Return the engine of a random network, with forces and energies at its initial state."""
    engine = engine_of(case)
    engine.update_forces(samples.network(case).state)
    return engine


def _compare_forces(actual: FloatArray, expected: FloatArray) -> Comparison:
    scale = float(np.abs(expected).max())
    return Comparison(actual, expected, np.zeros_like(expected), scale)


def _compare_numbers(actual: float, expected: float, scale: float) -> Comparison:
    return Comparison(np.array(actual), np.array(expected), np.array(0.0), scale)


def _compare_potential(problem: samples.StepProblem, engine: MujocoMassSpring) -> Comparison:
    system, state, _, _ = problem
    stored = 0.5 * system.stiffnesses * (engine.lengths() - system.rest_lengths) ** 2
    raised = np.abs(system.masses[:, None] * system.gravity * state.positions)
    return _compare_numbers(
        potential_energy(system, state.positions),
        engine.potential_energy(),
        scale=float(stored.sum() + raised.sum()),
    )
