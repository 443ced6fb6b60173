"""What a falling cloth is held against: converged implicit Euler, and the motion itself.

Converged implicit Euler is our Newton in steps of one frame. The motion itself is the classical
Runge-Kutta method, with h far below the limit of stability, halved twice: how fast the three come
together is the observed order, and the last difference bounds what is left.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import ExactStep, exact_step
from plumbob.reference import ImplicitEuler, State, runge_kutta
from plumbob.reference.arguments import FloatArray

from ...harness import metrics
from ...problems.falling_cloth import FRAME, FallingCloth, explicit_substeps

# Newton goes on to the rounding floor, which is above this, so that errors of 1e-8 can be measured.
TOLERANCE = 1e-14
MOST_ITERATIONS = 200
# Steps of the coarsest of the three motions, for those at symplectic Euler's limit.
_COARSE = 2.0


class ClothTruth(NamedTuple):
    """The answers, frame by frame.

    Attributes:
        start: positions before the first frame [m], (particle, 3).
        inertial: y of the first step, where the particles would go by themselves, (particle, 3).
        first: the end of the first step of implicit Euler, to 25 digits.
        implicit: positions by converged implicit Euler, (frame, particle, 3).
        true: positions of the motion itself, (frame, particle, 3).
        order: at which the motion's steps come together.
        unsure: rms distance between the two finest at the end [m].
    """

    start: FloatArray
    inertial: FloatArray
    first: ExactStep
    implicit: FloatArray
    true: FloatArray
    order: float
    unsure: float


@functools.cache
def truth_of(cloth: FallingCloth, frames: int) -> ClothTruth:
    """Return the answers for a cloth."""
    substeps = explicit_substeps(cloth.beat, _COARSE)
    coarse, middle, fine = (true_motion(cloth, frames, n * substeps) for n in (1, 2, 4))
    unsure = metrics.rms_distance(middle[-1], fine[-1])
    order = math.log2(metrics.rms_distance(coarse[-1], middle[-1]) / unsure)
    x, v = cloth.start.positions, cloth.start.velocities
    inertial = x + cloth.frame * np.where(cloth.system.free[:, None], v, 0.0)
    implicit = implicit_motion(cloth, frames, cloth.frame)
    first = exact_step(cloth.system, cloth.start, cloth.frame, implicit[0])
    return ClothTruth(x, inertial, first, implicit, fine, order, unsure)


def true_motion(cloth: FallingCloth, frames: int, substeps: int) -> FloatArray:
    """Return the positions by Runge-Kutta after each frame of so many steps."""
    state, positions = cloth.start, []
    for _ in range(frames):
        for _ in range(substeps):
            state = runge_kutta(cloth.system, state, cloth.frame / substeps)
        positions.append(state.positions)
    return np.array(positions)


def implicit_motion(cloth: FallingCloth, frames: int, frame: float = FRAME) -> FloatArray:
    """Return the positions by converged implicit Euler after each step of one frame.

    Raises:
        ArithmeticError: if a step does not converge: there is nothing to hold others against.
    """
    integrator = ImplicitEuler(
        cloth.system, h=frame, tolerance=TOLERANCE, max_iterations=MOST_ITERATIONS
    )
    state: State = cloth.start
    positions = []
    for i in range(frames):
        result = integrator.step(state)
        if not result.outcome.solved:
            raise ArithmeticError(f"Newton ended frame {i} as {result.outcome.name}")
        state = result.state
        positions.append(state.positions)
    return np.array(positions)
