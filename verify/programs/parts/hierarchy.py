"""Branches of a hierarchy, and the local rotations of global ones."""

from .rotations import conjugate, multiply


def joints_below(parents, joint):
    """Return the joints of the branch of a joint, parents first."""
    below = []
    for k in range(joint + 1, len(parents)):
        if parents[k] == joint or parents[k] in below:
            below.append(k)
    return below


def local_rotations_of(parents, R):
    q = R.copy()
    for j in range(1, len(parents)):
        q[j] = multiply(conjugate(R[parents[j]]), R[j])
    return q
