"""A square cloth in mid-fall, finer and stiffer: the same piece of fabric for every solver.

The cloth has the lab's springs without dampers, two metres a side and a mass of 1 kg for any number
of particles. Two corners are pinned. A damped fall by symplectic Euler has made its motion smooth.
The fall began a little uneven: an even cloth stays mirror-symmetric until rounding decides the side
of the fold.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
import scipy

from plumbob.crosscheck.mass_spring.equilibria import equilibrium
from plumbob.reference import MassSpring, State, scenes, symplectic_euler
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import stiffness_matrix

from .own import OwnProblem

SIDE, MASS, GRAVITY = 2.0, 1.0, 9.81  # [m], [kg], [m/s²]
# From the lab's cloth to a hundred times its stiffness [N/m].
STIFFNESSES = (1e2, 1e3, 1e4)
FRAME = 1 / 60  # [s]
# Frames of the fall: after 0.4 s the cloth is in motion, and neither straight nor folded.
FALLING = 24
_SEED = 2013  # of the uneven start
# Steps of the fall, in units of the limit of stability; a spring's damping over a particle's mass
# [1/s] meanwhile; the random displacement at first, in units of the spacing.
_FALL_MARGIN, _FALL_DAMPING, _UNEVEN = 1.5, 20.0, 1e-3


@dataclass(frozen=True, eq=False)
class FallingCloth:
    """A cloth in mid-fall."""

    size: int  # particles along each side
    stiffness: float  # of each spring [N/m]
    system: MassSpring  # particles and springs
    start: State  # the state in mid-fall
    frequency: float  # the highest there [rad/s]
    frame: float = FRAME  # the length of a frame [s]
    extent: float = SIDE  # how wide it is [m]

    @property
    def beat(self) -> float:
        """The highest frequency per `FRAME` [rad/s], which sets the number of explicit steps."""
        return self.frequency * self.frame / FRAME


@functools.lru_cache(maxsize=4)
def own_cloth(problem: OwnProblem) -> FallingCloth:
    """Return a user's cloth, which falls from its given state."""
    assert problem.cloth is not None
    system, start = problem.cloth
    frequency = highest_frequency(system, start.positions)
    extent = float(np.ptp(start.positions, axis=0).max())
    stiffness = float(system.stiffnesses.mean())
    return FallingCloth(
        system.particle_count, stiffness, system, start, frequency, problem.h, extent
    )


@functools.cache
def falling_cloth(size: int, stiffness: float) -> FallingCloth:
    """Return the cloth of size x size particles after its fall."""
    system, state = level_cloth(size, stiffness)
    substeps = explicit_substeps(highest_frequency(system, state.positions), _FALL_MARGIN)
    damped = system.replaced(dampings=_FALL_DAMPING * np.full(len(system.springs), MASS / size**2))
    for _ in range(FALLING * substeps):
        state = symplectic_euler(damped, state, FRAME / substeps)
    frequency = highest_frequency(system, state.positions)
    return FallingCloth(size, stiffness, system, state, frequency)


def level_cloth(size: int, stiffness: float) -> tuple[MassSpring, State]:
    """Return the cloth before its fall, still and all but level."""
    system, state = scenes.lab_cloth(
        size=size, side=SIDE, mass=MASS / size**2, stiffness=stiffness, gravity=GRAVITY
    )
    uneven = np.random.default_rng(_SEED).standard_normal(state.positions.shape)
    uneven *= _UNEVEN * SIDE / (size - 1)
    uneven[system.pinned] = 0.0
    return system, State(state.positions + uneven, state.velocities)


@functools.cache
def hanging_cloth(size: int, stiffness: float) -> tuple[MassSpring, FloatArray]:
    """Return the cloth and its positions at rest after its fall, (particle, 3)."""
    cloth = falling_cloth(size, stiffness)
    return cloth.system, equilibrium(cloth.system, cloth.start)


def highest_frequency(system: MassSpring, positions: FloatArray) -> float:
    """Return the square root of the largest eigenvalue of M^-1 K, pins held [rad/s].

    An eigenvalue errs by the square of its vector's error: a hundredth of the vector's is enough.
    """
    largest, _ = highest_mode(system, positions, tolerance=1e-2)
    return math.sqrt(largest)


def highest_mode(
    system: MassSpring, positions: FloatArray, tolerance: float = 0.0
) -> tuple[float, FloatArray]:
    """Return the largest eigenvalue of M^-1 K [1/s²] and its motion, (particle, 3), of length 1."""
    free = np.repeat(system.free, 3)
    scale = scipy.sparse.diags_array(1.0 / np.sqrt(np.repeat(system.masses, 3)[free]))
    K = stiffness_matrix(system, positions).tocsr()[free][:, free]
    start = np.random.default_rng(0).standard_normal(K.shape[0])
    largest, mode = scipy.sparse.linalg.eigsh(
        scale @ K @ scale, k=1, which="LA", v0=start, tol=tolerance
    )
    motion = np.zeros(3 * system.particle_count)
    motion[free] = scale @ mode[:, 0]
    return float(largest[0]), (motion / np.linalg.norm(motion)).reshape(-1, 3)


def explicit_substeps(frequency: float, margin: float) -> int:
    """Return `margin` times the steps a frame at symplectic Euler's limit h = 2/omega."""
    return math.ceil(margin * FRAME * frequency / 2.0)
