"""Rows of numbers, and linear systems of few equations."""

# Where a matrix is singular, a damping of so much of its trace keeps its factors above rounding.
ROUNDING_DAMPING = 1e-14


def solve(A, e, z, m):
    """Fill z of A z = e by the factors L D L', which overwrite A; 1/D comes on the diagonal."""
    for i in range(m):
        z[i] = e[i]
        for j in range(i):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s
        for j in range(i):
            s = A[i, j] * A[j, j]
            A[i, i] -= s * A[i, j]
            A[i, j] = s
            z[i] -= s * z[j]
        A[i, i] = 1.0 / A[i, i]
    for i in range(m - 1, -1, -1):
        z[i] *= A[i, i]
        for j in range(i + 1, m):
            z[i] -= A[j, i] * z[j]


def clear(row):
    """Set all entries of a row to zero."""
    for i in range(len(row)):
        row[i] = 0.0


def store(row, i, v):
    """Write a vector into three entries of a row."""
    row[i], row[i + 1], row[i + 2] = v


def inner(a, b):
    """Return the scalar product of two rows."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total
