"""Reference solutions of a falling cloth: a converged implicit step, and the true motion.

The step is by our Newton, refined to 25 digits in decimal arithmetic. The true motion is computed
by the classical Runge-Kutta method, with h far below the limit of stability and halved twice. The
observed order shows convergence, and the last difference bounds the remaining error.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import ExactStep, exact_step
from plumbob.reference import ImplicitEuler, runge_kutta
from plumbob.reference.arguments import FloatArray

from .falling_cloth import FRAME, FallingCloth, explicit_substeps

# Newton's rounding floor is above this value, so errors of 1e-8 can be measured.
TOLERANCE, MAX_ITERATIONS = 1e-14, 200
# Steps of the coarsest of the three motions, relative to symplectic Euler's limit.
_COARSE = 2.0


class ClothTruth(NamedTuple):
    """The reference solutions, frame by frame; positions [m] are (particle, 3)."""

    inertial: FloatArray  # y of the first step, the positions without forces
    first: ExactStep  # the end of the first step of implicit Euler, to 25 digits
    true: FloatArray  # of the true motion, (frame, particle, 3)
    path: float  # the rms distance that it moved [m]
    order: float  # observed order of convergence of the true motion
    # rms distance between the two finest motions at the end, over the distance moved
    unsure: float


@functools.cache
def truth_of(cloth: FallingCloth, frames: int) -> ClothTruth:
    """Return the reference solutions for a cloth."""
    substeps = explicit_substeps(cloth.beat, _COARSE)
    coarse, middle, fine = (true_motion(cloth, frames, n * substeps) for n in (1, 2, 4))
    distance = rms_distance(middle[-1], fine[-1])
    order = math.log2(rms_distance(coarse[-1], middle[-1]) / distance)
    inertial = inertial_positions(cloth, cloth.frame)
    path = rms_distance(fine[-1], cloth.start.positions)
    first = first_step(cloth, cloth.frame)
    return ClothTruth(inertial, first, fine, path, order, distance / path)


def first_step(cloth: FallingCloth, frame: float = FRAME) -> ExactStep:
    """Return the end of a step of implicit Euler of a frame [s], to 25 digits.

    Raises:
        ArithmeticError: if Newton does not converge.
    """
    integrator = ImplicitEuler(
        cloth.system, h=frame, tolerance=TOLERANCE, max_iterations=MAX_ITERATIONS
    )
    result = integrator.step(cloth.start)
    if not result.outcome.solved:
        raise ArithmeticError(f"Newton ended the step as {result.outcome.name}")
    return exact_step(cloth.system, cloth.start, frame, result.state.positions)


def inertial_positions(cloth: FallingCloth, frame: float) -> FloatArray:
    """Return the positions after a frame [s] without forces, (particle, 3)."""
    x, v = cloth.start.positions, cloth.start.velocities
    return x + frame * np.where(cloth.system.free[:, None], v, 0.0)


def true_motion(cloth: FallingCloth, frames: int, substeps: int) -> FloatArray:
    """Return the positions by Runge-Kutta after each frame of so many steps."""
    state, positions = cloth.start, []
    for _ in range(frames):
        state = runge_kutta(cloth.system, state, cloth.frame / substeps, steps=substeps)
        positions.append(state.positions)
    return np.array(positions)


def rms_distance(x: FloatArray, y: FloatArray) -> float:
    """Return the root mean square distance between the points of x and of y [m]."""
    return float(np.sqrt(np.mean(np.sum((x - y) ** 2, axis=-1))))
