"""Comparisons of forces, energies and stiffness with MuJoCo's tendons and flex edges."""

import numpy as np

from plumbob.reference.mass_spring import (
    State,
    damper_forces,
    kinetic_energy,
    potential_energy,
    spring_forces,
    stiffness_matrix,
)

from .. import samples
from ..engines import MujocoMassSpring
from ..verdict import Comparison
from .comparison import engine_at_start, engine_of, flex, forces, numbers

# Central differences of order 6: offsets in steps, and weights. The step is short compared with
# springs and long compared with the rounding error of their lengths.
OFFSETS = np.array([-3, -2, -1, 1, 2, 3])
WEIGHTS = np.array([-1, 9, -45, 45, -9, 1]) / 60.0
DIFFERENCE_STEP = 5e-4


def tendon_springs(case: int) -> Comparison:
    """Compare the springs' forces on the free particles, relative to the largest."""
    system, state, _, _ = samples.network(case)
    ours = spring_forces(system, state.positions)[system.free]
    return forces(ours, engine_at_start(case).spring_forces())


def tendon_dampers(case: int) -> Comparison:
    """Compare the dampers' forces on the free particles, relative to the largest."""
    system, state, _, _ = samples.network(case)
    ours = damper_forces(system, state)[system.free]
    return forces(ours, engine_at_start(case).damper_forces())


def tendon_stiffness(case: int) -> Comparison:
    """Compare K times a direction with differences of MuJoCo's forces along it.

    Cases in which the ends of a spring coincide are left out: its force has no derivative there.
    """
    smooth = case + (case + 3) // 4  # 0, 2, 3, 4, 5, 7, ...
    system, state, along, _ = samples.network(smooth)
    d = np.where(system.free[:, None], along, 0.0)
    pulls = []
    for offset in OFFSETS * DIFFERENCE_STEP:
        engine = engine_of(smooth)
        engine.update_forces(State(state.positions + offset * d, state.velocities))
        pulls.append(engine.spring_forces())
    theirs = -np.tensordot(WEIGHTS, pulls, 1) / DIFFERENCE_STEP
    ours = (stiffness_matrix(system, state.positions) @ d.ravel()).reshape(-1, 3)
    return forces(ours[system.free], theirs)


def tendon_potential(case: int) -> Comparison:
    """Compare the energy of springs and gravity, relative to the sum of its terms' magnitudes."""
    return _potential(samples.network(case), engine_at_start(case))


def point_kinetic(case: int) -> Comparison:
    """Compare the kinetic energy, relative to itself."""
    system, state, _, _ = samples.network(case)
    theirs = engine_at_start(case).kinetic_energy()
    return numbers(kinetic_energy(system, state), theirs, scale=theirs)


def flex_forces(case: int) -> Comparison:
    """Compare the forces of springs and dampers with those of the edges of a flex."""
    system, state, _, _ = samples.uniform(case)
    ours = spring_forces(system, state.positions) + damper_forces(system, state)
    engine = flex(case)
    return forces(ours[system.free], engine.spring_forces() + engine.damper_forces())


def flex_potential(case: int) -> Comparison:
    """Compare the energy of springs and gravity with that of a flex, like `tendon_potential`."""
    return _potential(samples.uniform(case), flex(case))


def _potential(problem: samples.StepProblem, engine: MujocoMassSpring) -> Comparison:
    system, state, _, _ = problem
    stored = 0.5 * system.stiffnesses * (engine.lengths() - system.rest_lengths) ** 2
    raised = np.abs(system.masses[:, None] * system.gravity * state.positions)
    ours = potential_energy(system, state.positions)
    return numbers(ours, engine.potential_energy(), scale=float(stored.sum() + raised.sum()))
