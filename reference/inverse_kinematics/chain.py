"""A single position to reach by a chain of unlimited balls, for all solvers and `restarts.py`.

The textbook forms of the solvers on a chain are four to nine times faster than on a mechanism.
"""

from typing import Any, NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..backend.memory import packed, part
from ..kinematics import forward_pose, normalise
from ..quaternion import (
    add,
    between,
    conjugate,
    cross,
    exponential,
    load_quaternion,
    load_vector,
    multiply,
    norm,
    perpendicular,
    renormalised,
    rotate,
    scale,
    store_quaternion,
    store_vector,
    subtract,
)
from ..skeleton import Skeleton
from .anderson import Mixing, forget, mixing_on, mixing_size
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

# A chain and target are collinear if no joint is further off their line than this, over the reach.
LINE_TOLERANCE = 1e-9
# A collinear chain is bent by this angle [rad] in all, shared evenly by its joints.
BEND = 2.0
# Distances are computed to a few of these, over the reach plus the target's distance.
POSITION_ROUNDING = 8 * 2.220446049250313e-16


class Chain(NamedTuple):
    """n links and n + 1 joints, the last the effector; link k joins joints k and k + 1."""

    offsets: FloatArray  # joint k's offset in the frame of joint k - 1 [m], (n + 1, 3)
    lengths: FloatArray  # link lengths [m], (n,)
    positions: FloatArray  # global joint positions [m], (n + 1, 3)
    rotations: FloatArray  # global joint rotations, (n + 1, 4)
    deltas: FloatArray  # the rotation of each joint in a sweep, (n, 4)
    reach: float  # total length [m]
    longest: float  # the longest link [m]
    row: FloatArray  # positions and rotations, one number after the other
    mixing: Mixing  # the last sweeps, of an accelerated solver


def new_chain(offsets, path, depth):
    """Return a chain with no pose yet along a path of joints; it can remember `depth` sweeps."""
    n = len(path) - 1
    along = np.empty((n + 1, 3))
    lengths = np.empty(n)
    reach, longest = 0.0, 0.0
    store_vector(along, 0, load_vector(offsets, path[0]))
    for k in range(n):
        link = load_vector(offsets, path[k + 1])
        store_vector(along, k + 1, link)
        lengths[k] = norm(link)
        reach += lengths[k]
        longest = max(longest, lengths[k])
    row, deltas, split = np.empty(7 * (n + 1)), np.empty((n, 4)), 3 * (n + 1)
    positions, rotations = row[:split].reshape(n + 1, 3), row[split:].reshape(n + 1, 4)
    mixing = mixing_on(np.empty(mixing_size(split, depth)), split, depth)
    return Chain(along, lengths, positions, rotations, deltas, reach, longest, row, mixing)


def pose_chain(chain, path, local):
    """Give the chain the pose of local rotations (joint, 4)."""
    store_vector(chain.positions, 0, load_vector(chain.offsets, 0))
    store_quaternion(chain.rotations, 0, load_quaternion(local, path[0]))
    for k in range(1, len(path)):
        R_parent = load_quaternion(chain.rotations, k - 1)
        store_quaternion(chain.rotations, k, multiply(R_parent, load_quaternion(local, path[k])))
    update_positions(chain)


def update_positions(chain):
    """Compute the positions from the rotations, the root fixed."""
    for k in range(len(chain.lengths)):
        link = rotate(load_quaternion(chain.rotations, k), load_vector(chain.offsets, k + 1))
        store_vector(chain.positions, k + 1, add(load_vector(chain.positions, k), link))


def rotate_links(chain):
    """Rotate every joint so that its link points at the next joint's position.

    The shortest arc from the link's old to its new direction multiplies the global rotation from
    the left: the joint keeps its twist about the link.
    """
    for k in range(len(chain.lengths)):
        R = load_quaternion(chain.rotations, k)
        link = rotate(R, load_vector(chain.offsets, k + 1))
        direction = subtract(load_vector(chain.positions, k + 1), load_vector(chain.positions, k))
        store_quaternion(chain.rotations, k, renormalised(multiply(between(link, direction), R)))


def store_local(chain, path, local):
    """Write the chain's local rotations to their rows of (joint, 4); the effector keeps its own."""
    store_quaternion(local, path[0], load_quaternion(chain.rotations, 0))
    for k in range(1, len(chain.lengths)):
        R_parent = load_quaternion(chain.rotations, k - 1)
        q = multiply(conjugate(R_parent), load_quaternion(chain.rotations, k))
        store_quaternion(local, path[k], renormalised(q))


def effector_error(chain, target):
    """Return the distance from the effector to the target [m]."""
    return norm(subtract(load_vector(chain.positions, len(chain.lengths)), target))


def root_distance(chain, target):
    """Return the distance from the root to the target [m]."""
    return norm(subtract(target, load_vector(chain.positions, 0)))


def least_distance(chain, d):
    """Return the least distance of the effector from a target at distance d from the root [m].

    The effector reaches the shell between the reach and the inner radius. The longest link leaves
    an inner radius when all others fold back: max(0, d - reach, 2 longest - reach - d).
    """
    return max(0.0, d - chain.reach, 2.0 * chain.longest - chain.reach - d)


def rounding(chain, d):
    """Return the rounding error of the distance to a target at distance d from the root [m]."""
    return POSITION_ROUNDING * (chain.reach + d)


def is_beyond_reach(chain, d):
    """Return whether a target at distance d lies at full reach, to rounding, or beyond."""
    return d >= chain.reach - rounding(chain, d)


def drawn_near(chain, target, beyond):
    """Return the target, drawn to within a distance of the effector's reachable points [m]."""
    root = load_vector(chain.positions, 0)
    direction = subtract(target, root)
    d = norm(direction)
    excess = least_distance(chain, d) - beyond
    if excess <= 0.0:
        return target
    if d <= rounding(chain, d):  # all directions are as near: the effector keeps its own
        direction = subtract(load_vector(chain.positions, len(chain.lengths)), root)
        d = norm(direction)
        return add(root, scale(excess / d, direction)) if d > 0.0 else target
    return add(root, scale((d - excess if d > chain.reach else d + excess) / d, direction))


def is_collinear(chain, target):
    """Return whether all joints and the target lie on a line through the root.

    Solvers rotate links towards the target in their common plane; on a line there is no plane to
    rotate in, and the chain stays there.
    """
    root = load_vector(chain.positions, 0)
    direction = subtract(target, root)
    for k in range(1, len(chain.positions)):
        arm = subtract(load_vector(chain.positions, k), root)
        if norm(direction) <= LINE_TOLERANCE * chain.reach:
            direction = arm
        elif norm(cross(direction, arm)) > LINE_TOLERANCE * chain.reach * norm(direction):
            return False
    return True


def bend(chain):
    """Bend all joints alike, the root too, about a fixed axis across the chain."""
    n = len(chain.lengths)
    direction = (0.0, 0.0, 0.0)
    for k in range(n):
        if norm(direction) == 0.0:
            R = load_quaternion(chain.rotations, k)
            direction = rotate(R, load_vector(chain.offsets, k + 1))
    axis = perpendicular(direction)
    for k in range(n):
        R = load_quaternion(chain.rotations, k)
        Q = exponential(scale(BEND * (k + 1) / n, axis))
        store_quaternion(chain.rotations, k, renormalised(multiply(Q, R)))
    update_positions(chain)


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
