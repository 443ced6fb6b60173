"""Smooth trajectories: motions along a curve with the smallest displacements between frames.

Minimise 1/2 sum_f |d_f|^2 over the poses q_f of all frames together, d_f the displacement from
frame f to the next, subject to every effector being on its target and every joint within its
limits. A displacement holds angles of hinges [rad], rotation vectors of balls [rad], and lengths
over the reach; a closed trajectory also counts the one from the last frame to the first.

The targets are kept exactly, by a Riemannian Newton method on the poses that meet them
(`riemannian_newton.py`), and the limits by an augmented Lagrangian (`augmented_lagrangian.py`). The
result is a local minimum. Long trajectories are solved on a coarse grid of frames first, and the
grid is then refined by halves.
"""

import numpy as np

from ..arguments import FloatArray, IndexArray, RecordArray
from ..inverse_kinematics.mechanism import Mechanism
from .problem import (
    TrajectoryProblem,
    displacements,
    integrate,
    near_singular,
    new_problem,
    project,
)
from .riemannian_newton import cost, minimise

__all__ = ["smooth"]

# The fewest frames of the coarsest grid.
COARSEST_GRID = 64


def smooth(
    mechanism: Mechanism, targets: RecordArray, q: FloatArray, reached: np.ndarray, closed: bool
) -> tuple[FloatArray, int]:
    """Return a smooth trajectory near q that follows the targets, and the Newton steps taken.

    The targets of each frame are records TARGET, (frame, effector); q holds the mechanism's
    coordinates to start from, (frame, coordinate). Frames that have `reached` their targets stay
    on them; a penalty draws all other frames towards theirs. The last frame leads back to the first
    if closed. Limits are kept to about 1e-10 rad.
    """
    problem = new_problem(mechanism, targets, reached, closed and len(q) > 2)
    projected, valid = project(problem, q)
    q = np.where(valid[:, None], projected, q)
    problem = problem._replace(constrained=reached & valid & ~near_singular(problem, q))
    result, steps = minimise_from_coarse(problem, q)
    z = np.zeros((len(q), len(problem.limits)))  # multipliers
    if cost(problem, result, z) > cost(problem, q, z):
        result, more = minimise(problem, q)
        steps += more
    return result, steps


def minimise_from_coarse(problem: TrajectoryProblem, q: FloatArray) -> tuple[FloatArray, int]:
    """Return a smooth trajectory near q, solved on finer and finer grids, and the steps taken."""
    stride = 1
    while len(q) >= 2 * stride * COARSEST_GRID:
        stride *= 2
    grid = every(stride, len(q), problem.closed)
    result, steps = minimise(problem.at(grid), q[grid])
    while stride > 1:
        stride //= 2
        coarse, grid = grid, every(stride, len(q), problem.closed)
        guess = interpolate(problem.at(coarse), result, coarse, grid, len(q))
        start, valid = project(problem.at(grid), guess)
        if not valid[problem.constrained[grid]].all():
            start = q[grid]
        result, more = minimise(problem.at(grid), start)
        steps += more
    return result, steps


def every(stride: int, frames: int, closed: bool) -> IndexArray:
    """Return the indices of every stride-th frame; of an open trajectory the last too."""
    grid = np.arange(0, frames, stride)
    return grid if closed or grid[-1] == frames - 1 else np.append(grid, frames - 1)


def interpolate(
    problem: TrajectoryProblem, q: FloatArray, coarse: IndexArray, dense: IndexArray, frames: int
) -> FloatArray:
    """Return the poses at the frames `dense`, along the displacements between `coarse` frames."""
    d, ends = displacements(problem, q), np.append(coarse, frames)
    before = np.searchsorted(coarse, dense, side="right") - 1
    fraction = (dense - coarse[before]) / (ends[before + 1] - coarse[before])
    return integrate(problem, q[before], fraction[:, None] * d[np.minimum(before, len(d) - 1)])
