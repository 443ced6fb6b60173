"""Reference solutions of a falling cloth: the minima of an implicit step, and the true motion.

The true motion is computed by the classical Runge-Kutta method, with h far below the limit of
stability and halved twice. The observed order shows convergence, and the last difference bounds the
remaining error.
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from plumbob.reference import runge_kutta
from plumbob.reference.arguments import FloatArray

from .falling_cloth import FallingCloth, explicit_substeps
from .step_minima import StepMinima, minima_of

# Steps of the coarsest of the three motions, relative to symplectic Euler's limit.
_COARSE = 2.0


class ClothTruth(NamedTuple):
    """The reference solutions, frame by frame; positions [m] are (particle, 3)."""

    first: StepMinima  # the ends of the first step of implicit Euler
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
    path = rms_distance(fine[-1], cloth.start.positions)
    first = minima_of(cloth.system, cloth.start, cloth.frame)
    return ClothTruth(first, fine, path, order, distance / path)


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
