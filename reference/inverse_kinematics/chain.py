"""The chain from the root to the effector: its arrays and its geometry, for all solvers."""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray
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
from .anderson import Mixing, mixing_on, mixing_size

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
