"""Springs one by one, in kernels: lengths and directions, pulls, blocks of the stiffness matrix.

See `mass_spring` for what a spring is.
"""

import numpy as np
from numpy import uint64 as at

from .quaternion import add, dot, load_vector, norm, scale, store_vector, subtract

# Ends closer than this [m] coincide: the square of their distance is no normal number.
COINCIDENT = 1e-150


def spring_pulls(x, v, system):
    """Return the forces of springs and dampers on each particle, shape (particle, 3)."""
    total = np.zeros(x.shape)
    for s in range(len(system.springs)):
        i, j = system.springs[s, 0], system.springs[s, 1]
        length, u = spring_frame(x, i, j)
        rate = dot(subtract(load_vector(v, i), load_vector(v, j)), u)
        stretch = spring_stretch(length, system.rest_lengths[s], system.tension_only[s])
        pull = scale(system.stiffnesses[s] * stretch + system.dampings[s] * rate, u)
        store_vector(total, i, subtract(load_vector(total, i), pull))
        store_vector(total, j, add(load_vector(total, j), pull))
    return total


def stiffness_blocks(x, system, geometric):
    """Return each spring's k u u', with k (1 - r/l) (I - u u') added if geometric; 0 if slack."""
    blocks = np.zeros((len(system.springs), 3, 3))
    for s in range(len(system.springs)):
        i, j = system.springs[s, 0], system.springs[s, 1]
        length, u = spring_frame(x, i, j)
        if is_slack(length, system.rest_lengths[s], system.tension_only[s]):
            continue
        k, across = system.stiffnesses[s], 0.0
        if geometric:
            across = k * share_across(length, system.rest_lengths[s])
        for a in range(3):
            blocks[s, a, a] = across
            for b in range(3):
                blocks[s, a, b] += (k - across) * (u[a] * u[b])
    return blocks


def share_across(length, rest_length):
    """Return 1 - r/l; where the ends coincide, 1 without a rest length and 0 with one."""
    if length >= COINCIDENT:
        return 1.0 - rest_length / length
    return 1.0 if rest_length == 0.0 else 0.0


def spring_lengths(x, springs):
    """Return the length of every spring, shape (spring,)."""
    lengths = np.empty(len(springs))
    for s in range(len(springs)):
        lengths[s], _ = spring_frame(x, springs[s, 0], springs[s, 1])
    return lengths


def sum_springs(springs, rest_lengths, stiffnesses, sums):
    """Add k r and 2 k of every spring to the sums of both its particles, (particle, 2)."""
    for s in range(len(springs)):
        k = stiffnesses[s]
        for end in range(2):
            i = at(springs[s, end])
            sums[i, 0] += k * rest_lengths[s]
            sums[i, 1] += 2.0 * k


def spring_stretches(x, system):
    """Return l - r of every spring, 0 if slack, shape (spring,)."""
    stretches = np.empty(len(system.springs))
    for s in range(len(system.springs)):
        length, _ = spring_frame(x, system.springs[s, 0], system.springs[s, 1])
        stretches[s] = spring_stretch(length, system.rest_lengths[s], system.tension_only[s])
    return stretches


def spring_rest_vectors(x, system):
    """Return r u of every spring, l u if slack, shape (spring, 3)."""
    vectors = np.empty((len(system.springs), 3))
    for s in range(len(system.springs)):
        length, u = spring_frame(x, system.springs[s, 0], system.springs[s, 1])
        rest_length = system.rest_lengths[s]
        if is_slack(length, rest_length, system.tension_only[s]):
            rest_length = length
        store_vector(vectors, s, scale(rest_length, u))
    return vectors


def spring_stretch(length, rest_length, tension_only):
    """Return l - r, or 0 for a slack spring."""
    stretch = length - rest_length
    return 0.0 if tension_only and stretch < 0.0 else stretch


def is_slack(length, rest_length, tension_only):
    """Return whether a tension-only spring hangs loose; one without a rest length never does."""
    return tension_only and rest_length > 0.0 and length <= rest_length


def spring_frame(x, i, j):
    """Return the length and the direction from particle j to i; (1, 0, 0) where they coincide."""
    p = subtract(load_vector(x, i), load_vector(x, j))
    length = norm(p)
    s = 1.0 / max(length, COINCIDENT)
    if length < COINCIDENT:
        p, s = (1.0, 0.0, 0.0), 1.0
    return length, scale(s, p)
