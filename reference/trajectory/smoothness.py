"""The smoothness of a trajectory: half the squared displacements, with two derivatives.

The displacement d from frame f to frame g is the velocity that leads from one to the other in unit
time, lengths over the reach. 1/2 |d|^2 has the gradient -d in frame f and d in frame g. For a ball,
with d = log(Q_f* Q_g), the second derivatives are S in either frame and -(S - 1/2 [d]x) between
them: S = c 1 + (1 - c) d d'/|d|^2, c = |d|/2 cot |d|/2, is the symmetric part of the inverse of the
right Jacobian of the exponential map (Sola et al. 2018).
"""

import math

import numpy as np

from ..articulation import BALL, FREE, HINGE
from ..jacobians import joint_difference, move_joint

# Below this angle [rad] the leading term of (1 - c)/|d|^2 is exact to rounding.
SMALL_ANGLE = 1e-4


def fill_displacements(problem, q, d):
    """Fill the displacements d, (displacement, freedom), between frames q, (frame, coordinate).

    With as many as frames the last one leads to the first frame; a continuous hinge then takes the
    smaller angle.
    """
    joints, units = problem.mechanism.joints, problem.units
    for f in range(len(d)):
        g = (f + 1) % len(q)
        for j in range(len(joints)):
            joint_difference(joints, j, q[g], q[f], d[f])
            unlimited = joints["lower"][j] == -math.inf and joints["upper"][j] == math.inf
            leads = joints["leader"][j] == j and not joints["followed"][j]
            if g < f and joints["kind"][j] == HINGE and unlimited and leads:
                k = joints["freedom"][j]
                d[f, k] -= 2.0 * math.pi * round(d[f, k] / (2.0 * math.pi))
        for k in range(len(units)):
            d[f, k] /= units[k]


def integrate_frames(problem, step, q):
    """Displace all frames by a step, (frame, freedom)."""
    joints, units = problem.mechanism.joints, problem.units
    v = np.empty(len(units))
    for f in range(len(q)):
        for k in range(len(v)):
            v[k] = units[k] * step[f, k]
        for j in range(len(joints)):
            move_joint(joints, j, v, q[f])


def add_smoothness(joints, d, gradient, diagonal, coupling):
    """Add the derivatives of half the squared displacements, see `QuadraticModel`."""
    for f in range(len(d)):
        g = (f + 1) % len(gradient)
        for k in range(d.shape[1]):
            gradient[f, k] -= d[f, k]
            gradient[g, k] += d[f, k]
            diagonal[f, k, k] += 1.0
            diagonal[g, k, k] += 1.0
            coupling[f, k, k] -= 1.0
        for j in range(len(joints)):
            if joints["kind"][j] in (BALL, FREE):
                k = joints["freedom"][j] + (3 if joints["kind"][j] == FREE else 0)
                add_curvature(d[f], k, diagonal[f], diagonal[g], coupling[f])


def add_curvature(d, k, before, after, coupling):
    """Add the second derivatives of the rotation vector from freedom k on, less +-1."""
    v = d[k], d[k + 1], d[k + 2]
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < SMALL_ANGLE * SMALL_ANGLE:
        factor = 1.0 / 12.0
    else:
        half = 0.5 * math.sqrt(square)
        factor = (1.0 - half * math.cos(half) / math.sin(half)) / square
    for a in range(3):
        for b in range(3):
            S = factor * (v[a] * v[b] - (square if a == b else 0.0))
            before[k + a, k + b] += S
            after[k + a, k + b] += S
            coupling[k + a, k + b] -= S
        # 1/2 [d]x
        coupling[k + (a + 1) % 3, k + a] += 0.5 * v[(a + 2) % 3]
        coupling[k + a, k + (a + 1) % 3] -= 0.5 * v[(a + 2) % 3]
