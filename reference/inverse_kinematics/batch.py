"""The loops around a solver's sweep: over the iterations of one solve, and over many solves."""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..kinematics import forward_pose, normalise
from ..outcome import Outcome
from ..quaternion import norm, subtract, vector_at
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


class Solved(NamedTuple):
    """What the kernels fill in, a row a target.

    Attributes:
        local: local rotations, (target, joint, 4).
        positions: global positions [m], (target, joint, 3).
        residuals: distances from effector to target [m], (target,).
        iterations: (target,).
        outcomes: values of Outcome, (target,).
        history: residuals before and after each iteration [m], (target, iteration), or (1, 1) when
            they are not wanted. After the last iteration the last residual is repeated.
    """

    local: FloatArray
    positions: FloatArray
    residuals: FloatArray
    iterations: IndexArray
    outcomes: IndexArray
    history: FloatArray


def solve_batch(tree, path, starts, targets, tolerance, max_iterations, chained, solved):
    """Solve target after target; return the index of the first start that is no rotation, or -1.

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
        local = solved.local[i]
        start = solved.local[i - 1] if chained and i > 0 else starts[i % len(starts)]
        if not normalise(start, local):
            return i % len(starts)
        target = vector_at(targets, i)
        history = solved.history[i % len(solved.history)]
        pose_chain(chain, path, local)
        iterations, stalled = iterate(chain, target, tolerance, max_iterations, history)
        if iterations > 0:
            turn_links(chain)
            put_local(chain, path, local)
        forward_pose(tree.parents, tree.offsets, local, solved.positions[i], rotations)
        residual = norm(subtract(vector_at(solved.positions[i], path[-1]), target))
        solved.residuals[i] = residual
        solved.iterations[i] = iterations
        solved.outcomes[i] = judge(chain, target, residual, tolerance, stalled)
    return -1


def iterate(chain, target, tolerance, max_iterations, history):
    """Sweep until the effector is on the target, or as near as geometry allows.

    Returns:
        The number of iterations, and whether the last one changed nothing but rounding.
    """
    d = root_distance(chain, target)
    # The residual is recomputed from the rotations in the end: leave that rounding some room.
    goal = least_distance(chain, d) + tolerance - min(8.0 * rounding(chain, d), 0.5 * tolerance)
    residual = tip_error(chain, target)
    history[:] = residual
    if residual > goal and not out_of_reach(chain, d) and on_one_line(chain, target):
        bend(chain)
    for i in range(max_iterations):
        if residual <= goal:
            return i, False
        before = residual
        sweep(chain, target)
        residual = tip_error(chain, target)
        history[min(i + 1, len(history)) :] = residual
        if abs(before - residual) <= rounding(chain, d):
            return i + 1, residual > goal
    return max_iterations, False


def judge(chain, target, residual, tolerance, stalled):
    """Return the outcome, by the residual recomputed and by geometry."""
    d = root_distance(chain, target)
    if residual <= tolerance:
        return Outcome.CONVERGED
    if least_distance(chain, d) > tolerance + rounding(chain, d):
        return Outcome.UNREACHABLE
    return Outcome.STALLED if stalled else Outcome.ITERATION_LIMIT
