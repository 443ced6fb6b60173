"""What a coherent motion makes least: half the squared jumps from frame to frame, by Newton.

The jump d from q_f to q_g is the velocity that leads from one to the other in a frame, ways over
the reach. Half its square has the gradient -d in frame f and d in frame g, and for a ball, whose
jump is the rotation vector d = log(Q_f* Q_g), the second derivatives S in both frames and
-(S - 1/2 [d]x) between them: S = c 1 + (1 - c) d d'/|d|^2, c = |d|/2 cot |d|/2, is the symmetric
part of the inverse of the exponential's derivative (Sola et al. 2018, eq. 144, 146).
"""

import math

import numpy as np

from ..articulation import BALL, FREE, FREEDOM, HINGE, KIND, LEADER, LOWER, UPPER
from ..jacobians import joint_difference, move_joint

# Below this angle the series of c to its square is exact to rounding.
SMALL = 1e-4


def fill_jumps(joints, worth, q, d):
    """Fill the jumps d, (jump, freedom), of frames q, (frame, coordinate).

    With as many jumps as frames the last one leads back to the first frame; joints that may turn
    without end then go the shorter way round.
    """
    for f in range(len(d)):
        g = (f + 1) % len(q)
        for j in range(len(joints.integers)):
            joint_difference(joints, j, q[g], q[f], d[f])
            if g < f and is_endless(joints, j):
                k = joints.integers[j, FREEDOM]
                d[f, k] -= 2.0 * math.pi * round(d[f, k] / (2.0 * math.pi))
        for k in range(len(worth)):
            d[f, k] /= worth[k]


def is_endless(joints, j):
    """Return whether a joint is a hinge that a whole turn brings back to where it was."""
    if joints.integers[j, KIND] != HINGE or joints.integers[j, LEADER] != j:
        return False
    for follower in range(len(joints.integers)):
        if follower != j and joints.integers[follower, LEADER] == j:
            return False
    return joints.numbers[j, LOWER] == -math.inf and joints.numbers[j, UPPER] == math.inf


def move_frames(joints, worth, step, q):
    """Move all frames by a step, (frame, freedom)."""
    v = np.empty(len(worth))
    for f in range(len(q)):
        for k in range(len(v)):
            v[k] = worth[k] * step[f, k]
        for j in range(len(joints.integers)):
            move_joint(joints, j, v, q[f])


def add_jumps(joints, d, gradient, within, between):
    """Add the derivatives of half the squared jumps.

    Args:
        joints: whose jumps they are.
        d: the jumps, (jump, freedom).
        gradient: by each frame, (frame, freedom).
        within: second derivatives by each frame, (frame, freedom, freedom).
        between: those by the frame after each jump and the one before it, (jump, freedom, freedom).
    """
    for f in range(len(d)):
        g = (f + 1) % len(gradient)
        for k in range(d.shape[1]):
            gradient[f, k] -= d[f, k]
            gradient[g, k] += d[f, k]
            within[f, k, k] += 1.0
            within[g, k, k] += 1.0
            between[f, k, k] -= 1.0
        for j in range(len(joints.integers)):
            if joints.integers[j, KIND] == BALL:
                add_turn(d[f], joints.integers[j, FREEDOM], within[f], within[g], between[f])
            elif joints.integers[j, KIND] == FREE:
                add_turn(d[f], joints.integers[j, FREEDOM] + 3, within[f], within[g], between[f])


def add_turn(d, k, before, after, between):
    """Add what the second derivatives of a turn, from freedom k on, have beside those of a way."""
    v = d[k], d[k + 1], d[k + 2]
    square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if square < SMALL * SMALL:
        share = 1.0 / 12.0
    else:
        half = 0.5 * math.sqrt(square)
        share = (1.0 - half * math.cos(half) / math.sin(half)) / square
    for a in range(3):
        for b in range(3):
            S = share * (v[a] * v[b] - (square if a == b else 0.0))
            before[k + a, k + b] += S
            after[k + a, k + b] += S
            between[k + a, k + b] -= S
        # 1/2 [d]x
        between[k + (a + 1) % 3, k + a] += 0.5 * v[(a + 2) % 3]
        between[k + a, k + (a + 1) % 3] -= 0.5 * v[(a + 2) % 3]
