"""Cyclic coordinate descent (Wang & Chen 1991)."""

from ..quaternion import (
    IDENTITY,
    add,
    between,
    multiply,
    normalised,
    put_quaternion,
    quaternion_at,
    rotate,
    subtract,
    vector_at,
)
from .chain import place_joints


def ccd_sweep(chain, target):
    """Turn each joint, from the effector's parent to the root, to point the effector at the target.

    A turn moves what lies below the joint. The joints still to come lie above and stay, so that of
    all that moves only the effector is needed on the way up; the turns are then applied from the
    root down, each to its joint and to all below it.
    """
    n = len(chain.lengths)
    effector = vector_at(chain.positions, n)
    for k in range(n - 1, -1, -1):
        joint = vector_at(chain.positions, k)
        turn, effector = ccd_turn(joint, effector, target)
        put_quaternion(chain.turns, k, turn)
    above = IDENTITY
    for k in range(n):
        above = normalised(multiply(above, quaternion_at(chain.turns, k)))
        R = quaternion_at(chain.rotations, k)
        put_quaternion(chain.rotations, k, normalised(multiply(above, R)))
    place_joints(chain)


def ccd_turn(joint, effector, target):
    """Return the shortest turn about a joint that brings the effector nearest, and where it goes.

    The effector moves on a sphere about the joint, and the point nearest to the target lies on the
    ray from the joint to the target: the distance cannot grow.
    """
    arm = subtract(effector, joint)
    turn = between(arm, subtract(target, joint))
    return turn, add(joint, rotate(turn, arm))
