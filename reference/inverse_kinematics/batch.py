"""The loops around a solver's sweep: over the iterations of one solve, and over many solves."""

from typing import NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..kinematics import forward_pose, normalise
from ..outcome import Outcome
from ..quaternion import load_vector, norm, subtract
from ..skeleton import SkeletonArrays
from .ccd import ccd_sweep as sweep  # the one that is bound to each solver's
from .chain import (
    bend,
    copy_pose,
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

# Columns of figures, (target, 6): the distance from effector to target [m], the angle between them
# [rad], the number of iterations, the value of the outcome, the merit [m], and the distance above
# what geometry proves to be the least [m].
RESIDUAL, RESIDUAL_ROTATION, ITERATIONS, OUTCOME, MERIT, EXCESS = FIGURES = range(6)


class Limits(NamedTuple):
    """When a solve on a chain ends.

    Attributes:
        tolerance: distance that counts as reached [m].
        max_iterations: of each period.
        far_iterations: the same where geometry proves the target out of reach.
        periods: how many; the best end of one is the answer.
    """

    tolerance: float
    max_iterations: int
    far_iterations: int
    periods: int


class Solved(NamedTuple):
    """What the kernel fills in, a row a target.

    Attributes:
        local: local rotations, (target, joint, 4).
        positions: global positions [m], (target, joint, 3).
        figures: (target, 6), see above.
        history: residuals before and after each iteration [m], (target, iteration), or (1, 1) when
            they are not wanted. What follows the last iteration is not filled.
    """

    local: FloatArray
    positions: FloatArray
    figures: FloatArray
    history: FloatArray


def solve_given(
    parents, offsets, path, starts, targets, tolerance, max_iterations, far_iterations, periods,
    chained, local, positions, figures, history,
):  # fmt: skip
    """Do what `solve_batch` does, called from Python: single arrays come in faster than tuples."""
    tree, solved = SkeletonArrays(parents, offsets), Solved(local, positions, figures, history)
    limits = Limits(tolerance, max_iterations, far_iterations, periods)
    return solve_batch(tree, path, starts, targets, limits, chained, solved)


def solve_batch(tree, path, starts, targets, limits, chained, solved):
    """Solve target after target; return whether all starts and targets were fit to compute with.

    Args:
        tree: SkeletonArrays.
        path: joints from the root to the effector.
        starts: local rotations, (start, joint, 4), used in turn.
        targets: global positions [m], (target, 3).
        limits: Limits.
        chained: whether each solve but the first starts from the solution before it.
        solved: Solved, filled.
    """
    chain = new_chain(tree.offsets, path)
    kept = new_chain(tree.offsets, path) if limits.periods > 1 else chain
    rotations = np.empty((len(tree.parents), 4))
    for i in range(len(targets)):
        local, target, figures = solved.local[i], load_vector(targets, i), solved.figures[i]
        start = solved.local[i - 1] if chained and i > 0 else starts[i % len(starts)]
        if not (normalise(start, local) and largest(target) <= LARGEST_COORDINATE):
            return False
        history = solved.history[i % len(solved.history)]
        pose_chain(chain, path, local)
        d = root_distance(chain, target)
        iterations, settled = iterate_periods(chain, kept, target, d, limits, history)
        if iterations > 0:
            turn_links(chain)
            put_local(chain, path, local)
        forward_pose(tree.parents, tree.offsets, local, solved.positions[i], rotations)
        residual = norm(subtract(load_vector(solved.positions[i], path[-1]), target))
        least = least_distance(chain, d)
        figures[RESIDUAL], figures[RESIDUAL_ROTATION] = residual, 0.0
        figures[ITERATIONS] = iterations
        figures[OUTCOME] = judge(chain, d, least, residual, limits.tolerance, settled).value
        figures[MERIT], figures[EXCESS] = residual, max(0.0, residual - least)
    return True


def largest(v):
    """Return the largest magnitude of a vector's components, NaN if it has one."""
    x, y, z = abs(v[0]), abs(v[1]), abs(v[2])
    return x + y + z if x + y + z != x + y + z else max(x, y, z)


def iterate_periods(chain, kept, target, d, limits, history):
    """Iterate for some periods of so many iterations each; leave the best end of a period.

    The target is at distance d from the root [m].

    Returns:
        The number of iterations, and whether the best settled.
    """
    residual, least, margin = tip_error(chain, target), least_distance(chain, d), rounding(chain, d)
    put_if_room(history, 0, residual)
    # The residual is recomputed from the rotations in the end: leave that rounding some room.
    tolerance = least + limits.tolerance - min(8.0 * margin, 0.5 * limits.tolerance)
    count = limits.far_iterations if least > limits.tolerance else limits.max_iterations
    if residual > tolerance and not out_of_reach(chain, d) and on_one_line(chain, target):
        bend(chain)
    done, settled = iterate(chain, target, tolerance, margin, count, history, 0)
    if settled or limits.periods == 1:
        return done, settled
    best = tip_error(chain, target)
    copy_pose(chain, kept)
    best_settled = False
    for _ in range(limits.periods - 1):
        made, settled = iterate(chain, target, tolerance, margin, count, history, done)
        done += made
        residual = tip_error(chain, target)
        if residual < best:
            best, best_settled = residual, settled
            copy_pose(chain, kept)
        if settled:
            break
    copy_pose(kept, chain)
    return done, best_settled


def iterate(chain, target, tolerance, margin, max_iterations, history, done):
    """Sweep until the effector is within the tolerance of the target, or makes no more progress.

    Distances are known to a margin [m].

    Returns:
        The number of iterations, and whether they ended because no more would be of use.
    """
    residual = tip_error(chain, target)
    for i in range(max_iterations):
        if residual <= tolerance:
            return i, True
        before = residual
        sweep(chain, target)
        residual = tip_error(chain, target)
        put_if_room(history, done + i + 1, residual)
        if abs(before - residual) <= margin:
            return i + 1, True
    return max_iterations, residual <= tolerance


def put_if_room(row, i, value):
    """Write an entry of a row if it has that many."""
    if i < len(row):
        row[i] = value


def judge(chain, d, least, residual, tolerance, settled):
    """Return the outcome, by the residual recomputed and by geometry."""
    if residual <= tolerance:
        return Outcome.CONVERGED
    if least > tolerance + rounding(chain, d):
        return Outcome.UNREACHABLE if settled else Outcome.UNREACHABLE_UNSETTLED
    return Outcome.STALLED if settled else Outcome.ITERATION_LIMIT
