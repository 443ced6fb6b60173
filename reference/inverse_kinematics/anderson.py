"""Anderson acceleration of sweeps (Anderson 1965; Walker & Ni 2011, the unconstrained form).

A sweep leads from x to g. Acceleration tries, in place of g, the affine combination of the last
sweeps whose changes g - x cancel best, brought back to what the joints allow. If this is no nearer
to the target than g, all sweeps are forgotten: the error falls as steadily as without acceleration.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray
from .linear_algebra import ROUNDING_DAMPING, inner, solve

# Earlier sweeps to combine with the last: with 10 there are hardly fewer sweeps.
DEPTH = 5


class Mixing(NamedTuple):
    """The numbers x before and after recent sweeps, to extrapolate; empty without acceleration."""

    sweep_count: FloatArray  # of the sweeps since all were forgotten, (1,)
    start: FloatArray  # x before the last sweep
    end: FloatArray  # x after it
    change: FloatArray  # the difference of both, times the scale
    scale: FloatArray  # of the numbers in the least squares
    ends: FloatArray  # how `end` differed between successive sweeps, (DEPTH, number)
    changes: FloatArray  # how `change` did
    A: FloatArray  # of the equations of the least squares, (DEPTH, DEPTH)
    rhs: FloatArray  # (DEPTH,)
    weights: FloatArray  # (DEPTH,)


def mixing_size(n, depth):
    """Return how many numbers hold `depth` sweeps over n numbers."""
    return 1 + min(depth, 1) * (2 * depth + 3) * n + depth * (depth + 2)


def mixing_on(block, n, depth):
    """Return what remembers `depth` sweeps over n numbers, in a row of `mixing_size`."""
    width, count = n * min(depth, 1), 2 * depth + 3
    rows = block[1 : 1 + count * width].reshape(count, width)
    square = block[1 + count * width :].reshape(depth + 2, depth)
    block[0] = 0.0
    return Mixing(
        block[:1], rows[0], rows[1], rows[2], np.ones(width), rows[3 : 3 + depth],
        rows[3 + depth :], square[:depth], square[depth], square[depth + 1],
    )  # fmt: skip


def forget(mixing):
    """Forget all sweeps."""
    mixing.sweep_count[0] = 0.0


def mix(mixing, x):
    """Remember the sweep from `start` to x and move x to a combination; return whether x moved.

    Let f be the scaled changes, and dF and dG the differences of f and of x between sweeps. The
    combination is x less dG w, where w minimises |f - dF w|.
    """
    count, ends, changes = int(mixing.sweep_count[0]), mixing.ends, mixing.changes
    depth, row, trace = min(count, DEPTH), (count - 1) % DEPTH, 0.0
    for i in range(len(x)):
        change = mixing.scale[i] * (x[i] - mixing.start[i])
        changes[row, i], ends[row, i] = change - mixing.change[i], x[i] - mixing.end[i]
        mixing.change[i], mixing.end[i] = change, x[i]
    mixing.sweep_count[0] += 1.0
    for i in range(depth):
        mixing.rhs[i] = inner(changes[i], mixing.change)
        for j in range(i + 1):
            mixing.A[i, j] = inner(changes[i], changes[j])
        trace += mixing.A[i, i]
    if trace == 0.0:
        return False
    for i in range(depth):
        mixing.A[i, i] += ROUNDING_DAMPING * trace
    solve(mixing.A, mixing.rhs, mixing.weights, depth)
    for i in range(depth):
        for k in range(len(x)):
            x[k] -= mixing.weights[i] * ends[i, k]
    return True
