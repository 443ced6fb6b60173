"""The loops around a solver's sweep: over the iterations of one solve, and over many solves."""

from typing import NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..kinematics import forward_pose, normalise
from ..outcome import Outcome
from ..quaternion import norm, subtract, vector_at
from ..skeleton import SkeletonArrays
from .ccd import ccd_sweep as sweep  # the one that is bound to each solver's
from .chain import (
    bend,
    least_distance,
    new_chain,
    on_one_line,
    out_of_reach,
    pose_chain,
    put_local,
    root_distance,
    rounding,
    tip_error,
    turn_links,
)

# Columns of figures, (target, 4): the distance from effector to target [m], the angle between them
# [rad], the number of iterations and the value of the outcome.
RESIDUAL, RESIDUAL_ROTATION, ITERATIONS, OUTCOME = range(4)


class Solved(NamedTuple):
    """What the kernel fills in, a row a target.

    Attributes:
        local: local rotations, (target, joint, 4).
        positions: global positions [m], (target, joint, 3).
        figures: (target, 4), see above.
        history: residuals before and after each iteration [m], (target, iteration), or (1, 1) when
            they are not wanted. After the last iteration the last residual is repeated.
    """

    local: FloatArray
    positions: FloatArray
    figures: FloatArray
    history: FloatArray


def solve_given(
    parents, offsets, path, starts, targets, tolerance, max_iterations, chained, local, positions,
    figures, history,
):  # fmt: skip
    """Do what `solve_batch` does, called from Python: single arrays come in faster than tuples."""
    tree, solved = SkeletonArrays(parents, offsets), Solved(local, positions, figures, history)
    return solve_batch(tree, path, starts, targets, tolerance, max_iterations, chained, solved)


def solve_batch(tree, path, starts, targets, tolerance, max_iterations, chained, solved):
    """Solve target after target; return whether all starts and targets were fit to compute with.

    Args:
        tree: SkeletonArrays.
        path: joints from the root to the effector.
        starts: local rotations, (start, joint, 4), used in turn.
        targets: global positions [m], (target, 3).
        tolerance: distance that counts as reached [m].
        max_iterations: of each solve.
        chained: whether each solve but the first starts from the solution before it.
        solved: Solved, filled.
    """
    chain = new_chain(tree.offsets, path)
    rotations = np.empty((len(tree.parents), 4))
    for i in range(len(targets)):
        local, target, figures = solved.local[i], vector_at(targets, i), solved.figures[i]
        start = solved.local[i - 1] if chained and i > 0 else starts[i % len(starts)]
        if not (normalise(start, local) and largest(target) <= LARGEST_COORDINATE):
            return False
        history = solved.history[i % len(solved.history)]
        pose_chain(chain, path, local)
        iterations, stalled = iterate(chain, target, tolerance, max_iterations, history)
        if iterations > 0:
            turn_links(chain)
            put_local(chain, path, local)
        forward_pose(tree.parents, tree.offsets, local, solved.positions[i], rotations)
        residual = norm(subtract(vector_at(solved.positions[i], path[-1]), target))
        figures[RESIDUAL], figures[RESIDUAL_ROTATION] = residual, 0.0
        figures[ITERATIONS] = iterations
        figures[OUTCOME] = judge(chain, target, residual, tolerance, stalled).value
    return True


def largest(v):
    """Return the largest magnitude of a vector's components, NaN if it has one."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    return x + y + z if x + y + z != x + y + z else max(x, y, z)


def iterate(chain, target, tolerance, max_iterations, history):
    """Sweep until the effector is on the target, or as near as geometry allows.

    Returns:
        The number of iterations, and whether they ended because no more would be of use.
    """
    d = root_distance(chain, target)
    # The residual is recomputed from the rotations in the end: leave that rounding some room.
    goal = least_distance(chain, d) + tolerance - min(8.0 * rounding(chain, d), 0.5 * tolerance)
    residual = tip_error(chain, target)
    fill_from(history, 0, residual)
    if residual > goal and not out_of_reach(chain, d) and on_one_line(chain, target):
        bend(chain)
    for i in range(max_iterations):
        if residual <= goal:
            return i, True
        before = residual
        sweep(chain, target)
        residual = tip_error(chain, target)
        fill_from(history, i + 1, residual)
        if abs(before - residual) <= rounding(chain, d):
            return i + 1, True
    return max_iterations, False


def fill_from(row, first, value):
    """Write a value into a row from an entry to its end."""
    for k in range(first, len(row)):
        row[k] = value


def judge(chain, target, residual, tolerance, stalled):
    """Return the outcome, by the residual recomputed and by geometry."""
    d = root_distance(chain, target)
    if residual <= tolerance:
        return Outcome.CONVERGED
    if least_distance(chain, d) > tolerance + rounding(chain, d):
        return Outcome.UNREACHABLE
    return Outcome.STALLED if stalled else Outcome.ITERATION_LIMIT
