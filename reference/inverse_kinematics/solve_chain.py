"""A single position to reach by a chain of unlimited balls, for the loops of `restarts.py`.

The textbook forms of the solvers on a chain are four to nine times faster than on a mechanism.
"""

from typing import Any

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..backend.memory import packed, part
from ..kinematics import forward_pose, normalise
from ..quaternion import load_vector, norm, subtract
from ..skeleton import Skeleton
from .anderson import forget
from .chain import (
    bend,
    effector_error,
    is_beyond_reach,
    is_collinear,
    least_distance,
    new_chain,
    pose_chain,
    root_distance,
    rotate_links,
    rounding,
    store_local,
)
from .restarts import (
    BEST,
    Criteria,
    Operations,
    copy_row,
    limits_of,
    new_search,
    solve_with_restarts,
)
from .result import OUTCOME, fill_figures, outcome_of, result_on


def packed_chain(skeleton: Skeleton, effector: int) -> FloatArray:
    """Return what `solve_chains` reads of a skeleton and its effector."""
    return packed(*skeleton.arrays, skeleton.path_array(effector))


def solve_chains(operations, depth, problem, numbers, starts, targets, results, first, last):
    """Solve the targets from `first` to `last`; return whether starts and targets were valid.

    Args:
        operations: of a solver, on a Chain.
        depth: how many sweeps the solver remembers.
        problem: see `packed_chain`.
        numbers: of Limits.
        starts: local rotations, of one start or of as many as targets, row after row.
        targets: global positions [m], row after row.
        results: see `result_on`.
        first: index of the first target.
        last: index behind the last.
    """
    parents, path = part(problem, 0, np.int64), part(problem, 2, np.int64)
    joints = len(parents)
    offsets = part(problem, 1, np.float64).reshape(joints, 3)
    start_rows, target_rows = starts.reshape(-1, joints, 4), targets.reshape(-1, 3)
    result = result_on(results, len(target_rows), joints, 0)
    limits, chain = limits_of(numbers), new_chain(offsets, path, depth)
    search, rotations = new_search(1, len(chain.row)), np.empty((joints, 4))
    for i in range(first, last):
        pose, target = result.local[i], load_vector(target_rows, i)
        is_chained = limits.chained and i > 0
        start = result.local[i - 1] if is_chained else start_rows[i % len(start_rows)]
        if not (normalise(start, pose) and is_within(target, LARGEST_COORDINATE)):
            return False
        pose_chain(chain, path, pose)
        forget(chain.mixing)
        d = root_distance(chain, target)
        criteria, past = chain_criteria(chain, d, limits), result.history[i]
        iterations, stalled = solve_with_restarts(operations, chain, search, target, criteria, past)
        if iterations > 0:
            copy_row(search.rows[BEST], chain.row)
            rotate_links(chain)
            store_local(chain, path, pose)
        positions, figures = result.positions[i], result.figures[i]
        forward_pose(parents, offsets, pose, positions, rotations)
        distance = norm(subtract(load_vector(positions, path[-1]), target))
        bound = least_distance(chain, d)
        fill_figures(figures, distance, 0.0, iterations, distance, bound)
        unreachable = bound > limits.tolerance + rounding(chain, d)
        figures[OUTCOME] = outcome_of(distance <= limits.tolerance, unreachable, stalled).value
    return True


def is_within(v, bound):
    """Return whether no component of a vector is beyond a bound, or NaN."""
    return abs(v[0]) <= bound and abs(v[1]) <= bound and abs(v[2]) <= bound


def chain_criteria(chain, d, limits):
    """Return the end criteria of attempts at a target at distance d from the root [m]."""
    bound, margin = least_distance(chain, d), rounding(chain, d)
    slack = min(8.0 * margin, 0.5 * limits.tolerance)
    count = limits.far_iterations if bound > limits.tolerance else limits.max_iterations
    distance = bound + limits.tolerance - slack
    return Criteria(
        distance, limits.tolerance_rotation, margin, count, 0, 1, limits.restarts, False, False
    )


def chain_error(chain, target):
    """Return the distance from effector to target [m] in the form of `Operations.error`."""
    distance = effector_error(chain, target)
    return distance, 0.0, distance, distance


def perturb_chain(chain, target, criteria, first):
    """Bend a chain that starts collinear with its target: CCD and FABRIK would stay on the line."""
    if first["iterations"] > 0 or effector_error(chain, target) <= criteria.distance:
        return False
    if is_beyond_reach(chain, root_distance(chain, target)) or not is_collinear(chain, target):
        return False
    bend(chain)
    return True


def place_chain(_chain):
    """Leave a chain unchanged: its row holds its positions and rotations themselves."""


def draw_chain(_chain, _target, _criteria, _n):
    """Leave a chain unchanged: its random restarts are made on a mechanism."""


def shift_chain(_chain, _n):
    """Leave a chain unchanged: phases are for mechanisms."""


def on_chains(sweep: Any) -> Operations:
    """Return the operations of a solver that makes such a sweep."""
    return Operations(
        sweep, chain_error, effector_error, perturb_chain, place_chain, draw_chain, shift_chain
    )
