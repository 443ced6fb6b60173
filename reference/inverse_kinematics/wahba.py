"""The rotation that brings several directions nearest to others (Wahba 1965).

To rotate vectors a onto b, weighted, maximise the sum of w b . S a = tr(S M'), M the sum of w b a'.
For a quaternion q of S this is q' K q with Davenport's symmetric 4 x 4 matrix K (Horn 1987). The
best q is the eigenvector of the largest eigenvalue; about a fixed axis the unknown is an angle.
"""

import math

from ..quaternion import dot

# Where all vectors are collinear many rotations are best. The identity, added by this share of M's
# norm, makes the smallest rotation the best. The addition brings no vector further from its own.
IDENTITY_WEIGHT = 1e-6
# Below this share of M's norm rounding hides the best angle.
ANGLE_ROUNDING = 1e-15
# Sweeps of Jacobi's method: none of 20,000 matrices, graded and nearly singular too, needed 8.
SWEEPS = 12
ZERO_MATRIX = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def add_outer(M, weight, b, a):
    """Return M + weight b a', matrices as nine entries, row by row."""
    x, y, z = weight * b[0], weight * b[1], weight * b[2]
    return (
        M[0] + x * a[0], M[1] + x * a[1], M[2] + x * a[2],
        M[3] + y * a[0], M[4] + y * a[1], M[5] + y * a[2],
        M[6] + z * a[0], M[7] + z * a[1], M[8] + z * a[2],
    )  # fmt: skip


def add_rotation(M, weight, R):
    """Return M + weight R, R given as a quaternion."""
    w, x, y, z = R
    return (
        M[0] + weight * (1.0 - 2.0 * (y * y + z * z)),
        M[1] + weight * 2.0 * (x * y - w * z),
        M[2] + weight * 2.0 * (x * z + w * y),
        M[3] + weight * 2.0 * (x * y + w * z),
        M[4] + weight * (1.0 - 2.0 * (x * x + z * z)),
        M[5] + weight * 2.0 * (y * z - w * x),
        M[6] + weight * 2.0 * (x * z - w * y),
        M[7] + weight * 2.0 * (y * z + w * x),
        M[8] + weight * (1.0 - 2.0 * (x * x + y * y)),
    )  # fmt: skip


def best_angle(M, axis):
    """Return the angle about a unit axis that maximises tr(S M'), 0 if all are alike to rounding.

    tr(S M') = cos t (tr M - axis' M axis) + sin t (axis . vex M) + a constant.
    """
    x, y, z = axis
    along = (
        x * (M[0] * x + M[1] * y + M[2] * z)
        + y * (M[3] * x + M[4] * y + M[5] * z)
        + z * (M[6] * x + M[7] * y + M[8] * z)
    )
    cosine = M[0] + M[4] + M[8] - along
    sine = dot(axis, (M[7] - M[5], M[2] - M[6], M[3] - M[1]))
    if abs(sine) + abs(cosine) <= ANGLE_ROUNDING * magnitude(M):
        return 0.0
    return math.atan2(sine, cosine)


def alignment(M, S):
    """Return tr(S M'), which the best rotation S maximises."""
    R = add_rotation(ZERO_MATRIX, 1.0, S)
    total = 0.0
    for i in range(9):
        total += R[i] * M[i]
    return total


def magnitude(M):
    """Return the root of the sum of the entries' squares, the same in all frames."""
    total = 0.0
    for m in M:
        total += m * m
    return math.sqrt(total)


def best_rotation(M, K, V):
    """Return the rotation S that maximises tr(S M'); K and V are overwritten, (4, 4).

    Jacobi's rotations diagonalise K and make up V; q is the column of the largest eigenvalue.
    """
    extra = IDENTITY_WEIGHT * magnitude(M)
    trace = M[0] + M[4] + M[8] + 3.0 * extra
    K[0, 0], K[0, 1], K[0, 2], K[0, 3] = trace, M[7] - M[5], M[2] - M[6], M[3] - M[1]
    K[1, 1], K[1, 2], K[1, 3] = 2.0 * (M[0] + extra) - trace, M[1] + M[3], M[2] + M[6]
    K[2, 2], K[2, 3] = 2.0 * (M[4] + extra) - trace, M[5] + M[7]
    K[3, 3] = 2.0 * (M[8] + extra) - trace
    diagonalise(K, V)
    best = 0
    for i in range(1, 4):
        if K[i, i] > K[best, best]:
            best = i
    w, x, y, z = V[0, best], V[1, best], V[2, best], V[3, best]
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        length = -length
    return w / length, x / length, y / length, z / length


def diagonalise(K, V):
    """Make the symmetric K, given by its upper triangle, diagonal; fill V with its eigenvectors."""
    for i in range(4):
        for j in range(4):
            V[i, j] = 1.0 if i == j else 0.0
        for j in range(i):
            K[i, j] = K[j, i]
    for _ in range(SWEEPS):
        remainder = 0.0
        for i in range(4):
            for j in range(i + 1, 4):
                remainder += abs(K[i, j])
        if remainder == 0.0:
            return
        for i in range(4):
            for j in range(i + 1, 4):
                annihilate(K, V, i, j)


def annihilate(K, V, i, j):
    """Rotate rows and columns i and j so that K[i, j] is zero (Jacobi 1846)."""
    entry = K[i, j]
    if abs(entry) <= 1e-17 * (abs(K[i, i]) + abs(K[j, j])):
        K[i, j] = K[j, i] = 0.0
        return
    ratio = (K[j, j] - K[i, i]) / (2.0 * entry)
    t = 1.0 / (abs(ratio) + math.sqrt(1.0 + ratio * ratio))
    if ratio < 0.0:
        t = -t
    c = 1.0 / math.sqrt(1.0 + t * t)
    s = t * c
    for k in range(4):
        a, b = K[k, i], K[k, j]
        K[k, i], K[k, j] = c * a - s * b, s * a + c * b
    for k in range(4):
        a, b = K[i, k], K[j, k]
        K[i, k], K[j, k] = c * a - s * b, s * a + c * b
    for k in range(4):
        a, b = V[k, i], V[k, j]
        V[k, i], V[k, j] = c * a - s * b, s * a + c * b
