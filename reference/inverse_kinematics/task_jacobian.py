"""The errors of all effectors, stacked, and their Jacobian: the linear system of a task.

An error is the vector from an effector to its target [m] and, where its rotation matters, the
rotation vector to its target's times a lever [m], each times the root of the effector's weight. The
Jacobian holds how the effectors move by a unit of each freedom, a row a freedom: its transpose.
"""

import math

from ..articulation import FREEDOMS
from ..motion_subspace import accumulate, motion, velocity_at
from ..quaternion import load_vector, logarithm, scale, subtract
from .mechanism import LEVER, effector_position, position_error, rotation_error


def fill_errors(mechanism, target, data, e):
    """Fill the errors, (equation,)."""
    effectors, lever = mechanism.effectors, LEVER * mechanism.reach
    for i in range(len(effectors)):
        row, root = effectors["row"][i], math.sqrt(target["weight"][i])
        store(e, row, scale(root, position_error(mechanism, target, data, i)))
        if effectors["oriented"][i]:
            error = logarithm(rotation_error(mechanism, target, data, i))
            store(e, row + 3, scale(root * lever, error))


def fill_jacobian(mechanism, target, data, J):
    """Fill the Jacobian transposed, (freedom, equation): -de/dq, of translations over the reach."""
    joints = mechanism.joints
    for k in range(len(J)):
        clear(J[k])
    for j in range(len(joints)):
        for i in range(FREEDOMS[joints["kind"][j]]):
            angular, linear = motion(joints, j, i, data.rotations, mechanism.reach)
            row = J[joints["freedom"][j] + i]
            add_motion(mechanism, target, data, j, angular, linear, row)


def add_motion(mechanism, target, data, j, angular, linear, row):
    """Add to a row what a motion of joint j does to the effectors below."""
    effectors, lever = mechanism.effectors, LEVER * mechanism.reach
    x = load_vector(data.positions, j)
    for e in range(len(effectors)):
        if mechanism.moves[j, e]:
            at, root = effectors["row"][e], math.sqrt(target["weight"][e])
            arm = subtract(effector_position(mechanism, data, e), x)
            accumulate(row, at, scale(root, velocity_at(angular, linear, arm)))
            if effectors["oriented"][e]:
                accumulate(row, at + 3, scale(root * lever, angular))


def clear(row):
    """Set all entries of a row to zero."""
    for i in range(len(row)):
        row[i] = 0.0


def store(row, i, v):
    """Write a vector into three entries of a row."""
    row[i], row[i + 1], row[i + 2] = v
