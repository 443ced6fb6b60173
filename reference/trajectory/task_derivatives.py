"""Errors of the effectors, with their first and second derivatives by the freedoms of the joints.

An error is the vector from an effector to its target [m] and, where rotations matter, the rotation
vector between them times a lever [m], times the square root of the effector's weight. Motions a
above b on the path to an effector, of angular velocities w_a and w_b, change its position by the
second derivative w_a x v_b, v_b its velocity by motion b; and its rotation vector by 1/2 w_a x w_b
where the error is zero (the second term of the Baker-Campbell-Hausdorff series). For two rotations
of a ball the mean of both orders counts.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import FREEDOMS
from ..inverse_kinematics.box_step import fill_errors, fill_jacobian
from ..inverse_kinematics.mechanism import (
    LEVER,
    effector_position,
    new_data,
    update_forward_kinematics,
)
from ..inverse_kinematics.restarts import copy_row
from ..jacobians import motion, velocity_at
from ..quaternion import add, cross, dot, load_vector, scale, store_vector, subtract


class Motions(NamedTuple):
    """The motions by all freedoms, from the root on: each a rotation or a translation."""

    owners: IndexArray  # the joint and the freedom of each, (motion, 2)
    angular: FloatArray  # angular velocities by a unit of the freedom, in the world, (motion, 3)
    linear: FloatArray  # linear velocities of the joint [m], (motion, 3)
    # vectors whose product with the angular velocity of a motion above is m times the effector's
    # second derivative by both, (motion, 3)
    moments: FloatArray


def fill_errors_and_jacobians(problem, q, e, J):
    """Fill errors e [m], (frame, equation), and J = -de/dq, (frame, equation, freedom)."""
    mechanism, targets = problem.mechanism, problem.targets
    data = new_data(mechanism)
    for f in range(len(q)):
        copy_row(q[f], data.q)
        update_forward_kinematics(mechanism, data)
        fill_errors(mechanism, targets[f], data, e[f])
        fill_jacobian(mechanism, targets[f], data, J[f].T)


def subtract_second_derivatives(problem, q, m, diagonal):
    """Subtract m, (frame, equation), times the second derivatives of the effectors."""
    mechanism = problem.mechanism
    data, count = new_data(mechanism), FREEDOMS[mechanism.joints["kind"]].sum()
    angular, linear, moments = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    motions = Motions(np.empty((count, 2), dtype=np.int64), angular, linear, moments)
    for f in range(len(q)):
        copy_row(q[f], data.q)
        update_forward_kinematics(mechanism, data)
        fill_motions(mechanism, data, motions)
        for e in range(len(mechanism.effectors)):
            fill_moments(mechanism, problem.targets[f], data, motions, m[f], e)
            subtract_effector(mechanism, motions, e, diagonal[f])


def fill_motions(mechanism, data, motions):
    """Fill the motions of a frame, but for their moments."""
    joints, at = mechanism.joints, 0
    for j in range(len(joints)):
        for i in range(FREEDOMS[joints["kind"][j]]):
            angular, linear = motion(joints, j, i, data.rotations, mechanism.reach)
            motions.owners[at, 0], motions.owners[at, 1] = j, joints["freedom"][j] + i
            store_vector(motions.angular, at, angular)
            store_vector(motions.linear, at, linear)
            at += 1


def fill_moments(mechanism, target, data, motions, m, e):
    """Fill the moments of all motions for an effector."""
    effectors = mechanism.effectors
    row, root = effectors["row"][e], np.sqrt(target["weight"][e])
    force, x = scale(root, (m[row], m[row + 1], m[row + 2])), effector_position(mechanism, data, e)
    for b in range(len(motions.owners)):
        angular, linear = load_vector(motions.angular, b), load_vector(motions.linear, b)
        arm = subtract(x, load_vector(data.positions, motions.owners[b, 0]))
        moment = cross(velocity_at(angular, linear, arm), force)
        if effectors["oriented"][e]:
            lever = 0.5 * root * LEVER * mechanism.reach
            torque = scale(lever, (m[row + 3], m[row + 4], m[row + 5]))
            moment = add(moment, cross(angular, torque))
        store_vector(motions.moments, b, moment)


def subtract_effector(mechanism, motions, e, diagonal):
    """Subtract m times the second derivatives of an effector."""
    owners, angular, _, moments = motions
    for b in range(len(owners)):
        j, k = owners[b]
        if not mechanism.moves[j, e]:
            continue
        for a in range(b + 1):
            above, i = owners[a]
            if mechanism.moves[above, e]:
                second = dot(load_vector(angular, a), load_vector(moments, b))
                rotates = dot(load_vector(angular, a), load_vector(angular, a)) > 0.0
                if above == j and rotates:
                    second = 0.5 * (second + dot(load_vector(angular, b), load_vector(moments, a)))
                diagonal[i, k] -= second
                if a != b:
                    diagonal[k, i] -= second
