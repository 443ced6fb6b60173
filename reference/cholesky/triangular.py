"""Forward and backward substitution: L is read once in the order it is stored, once in reverse.

Three right-hand sides go through together, so that L comes from memory once for all of them, and
four columns at a time, so that the right-hand sides come from the cache once for all of these.

Indices are made unsigned (`at`) where speed matters: the test for a negative index would keep the
compiler from using vector instructions, and so would slices, whose owners are counted.
"""

import numpy as np
from numpy import uint64 as at

SIDES = 3


def solve(order, columns, starts, rows, tallest, values, b, x):
    """Set x to the solution of A x = b, three right-hand sides, shape (n, 3).

    The arguments are those of `Supernodes`, one by one: a tuple takes longer to hand over than a
    small system to solve.
    """
    y, t, p = np.empty(x.shape), np.empty((SIDES, tallest)), starts[0]
    for j in range(len(order)):
        v = order[j]
        y[j, 0], y[j, 1], y[j, 2] = b[v, 0], b[v, 1], b[v, 2]
    for s in range(len(columns) - 1):
        first, width = columns[s], columns[s + 1] - columns[s]
        size = width + starts[s + 1] - starts[s]
        fetch(y, first, width, t)
        for i in range(width, size):
            t[0, at(i)], t[1, at(i)], t[2, at(i)] = 0.0, 0.0, 0.0
        p = eliminate_block(values, p, width, size, t)
        put_back(y, first, width, t)
        below = starts[s] - width
        for i in range(width, size):
            row = at(rows[at(below + i)])
            y[row, 0] += t[0, at(i)]
            y[row, 1] += t[1, at(i)]
            y[row, 2] += t[2, at(i)]
    for s in range(len(columns) - 2, -1, -1):
        first, width = columns[s], columns[s + 1] - columns[s]
        size = width + starts[s + 1] - starts[s]
        fetch(y, first, width, t)
        below = starts[s] - width
        for i in range(width, size):
            row = at(rows[at(below + i)])
            t[0, at(i)], t[1, at(i)], t[2, at(i)] = y[row, 0], y[row, 1], y[row, 2]
        p = substitute_block(values, p, width, size, t)
        put_back(y, first, width, t)
    for j in range(len(order)):
        v = order[j]
        x[v, 0], x[v, 1], x[v, 2] = y[j, 0], y[j, 1], y[j, 2]


def fetch(y, first, width, t):
    """Copy the unknowns of a supernode's columns to the front of t."""
    for i in range(width):
        row = at(first + i)
        t[0, at(i)], t[1, at(i)], t[2, at(i)] = y[row, 0], y[row, 1], y[row, 2]


def put_back(y, first, width, t):
    """Copy the unknowns of a supernode's columns back from t."""
    for i in range(width):
        row = at(first + i)
        y[row, 0], y[row, 1], y[row, 2] = t[0, at(i)], t[1, at(i)], t[2, at(i)]


def eliminate_block(values, p, width, size, t):
    """Solve with a supernode's diagonal block; below, take off what follows from the solution.

    Its columns begin at p in `values`; return where they end.
    """
    j = 0
    while j + 4 <= width:
        q, r, s = p + size - j, p + 2 * (size - j) - 1, p + 3 * (size - j) - 3
        lower_four(values, p, q, r, s, t, j)
        a0, b0 = t[0, at(j)], t[0, at(j + 1)]
        c0, d0 = t[0, at(j + 2)], t[0, at(j + 3)]
        a1, b1 = t[1, at(j)], t[1, at(j + 1)]
        c1, d1 = t[1, at(j + 2)], t[1, at(j + 3)]
        a2, b2 = t[2, at(j)], t[2, at(j + 1)]
        c2, d2 = t[2, at(j + 2)], t[2, at(j + 3)]
        for i in range(size - j - 4):
            a, b = values[at(p + 4 + i)], values[at(q + 3 + i)]
            c, d = values[at(r + 2 + i)], values[at(s + 1 + i)]
            row = at(j + 4 + i)
            t[0, row] -= a * a0 + b * b0 + c * c0 + d * d0
            t[1, row] -= a * a1 + b * b1 + c * c1 + d * d1
            t[2, row] -= a * a2 + b * b2 + c * c2 + d * d2
        p, j = s + size - j - 3, j + 4
    while j < width:
        inverse = 1.0 / values[at(p)]
        a0, a1, a2 = t[0, at(j)] * inverse, t[1, at(j)] * inverse, t[2, at(j)] * inverse
        t[0, at(j)], t[1, at(j)], t[2, at(j)] = a0, a1, a2
        for i in range(size - j - 1):
            a, row = values[at(p + 1 + i)], at(j + 1 + i)
            t[0, row] -= a * a0
            t[1, row] -= a * a1
            t[2, row] -= a * a2
        p, j = p + size - j, j + 1
    return p


def substitute_block(values, p, width, size, t):
    """Solve with a supernode's transposed block, all below being known.

    Its columns end at p in `values`; return where they begin.
    """
    j = width
    while j % 4 > 0:
        j -= 1
        p -= size - j
        s0, s1, s2 = 0.0, 0.0, 0.0
        for i in range(size - j - 1):
            a, row = values[at(p + 1 + i)], at(j + 1 + i)
            s0 += a * t[0, row]
            s1 += a * t[1, row]
            s2 += a * t[2, row]
        inverse = 1.0 / values[at(p)]
        t[0, at(j)] = (t[0, at(j)] - s0) * inverse
        t[1, at(j)] = (t[1, at(j)] - s1) * inverse
        t[2, at(j)] = (t[2, at(j)] - s2) * inverse
    while j > 0:
        j -= 4
        p -= 4 * (size - j) - 6
        q, r, s = p + size - j, p + 2 * (size - j) - 1, p + 3 * (size - j) - 3
        a0, b0, c0, d0 = 0.0, 0.0, 0.0, 0.0
        a1, b1, c1, d1 = 0.0, 0.0, 0.0, 0.0
        a2, b2, c2, d2 = 0.0, 0.0, 0.0, 0.0
        for i in range(size - j - 4):
            a, b = values[at(p + 4 + i)], values[at(q + 3 + i)]
            c, d = values[at(r + 2 + i)], values[at(s + 1 + i)]
            row = at(j + 4 + i)
            v0, v1, v2 = t[0, row], t[1, row], t[2, row]
            a0, b0, c0, d0 = a0 + a * v0, b0 + b * v0, c0 + c * v0, d0 + d * v0
            a1, b1, c1, d1 = a1 + a * v1, b1 + b * v1, c1 + c * v1, d1 + d * v1
            a2, b2, c2, d2 = a2 + a * v2, b2 + b * v2, c2 + c * v2, d2 + d * v2
        take(t, 0, j, a0, b0, c0, d0)
        take(t, 1, j, a1, b1, c1, d1)
        take(t, 2, j, a2, b2, c2, d2)
        upper_four(values, p, q, r, s, t, j)
    return p


def take(t, side, j, a, b, c, d):
    """Take (a, b, c, d) off four unknowns of one side."""
    t[side, at(j)] -= a
    t[side, at(j + 1)] -= b
    t[side, at(j + 2)] -= c
    t[side, at(j + 3)] -= d


def lower_four(values, p, q, r, s, t, j):
    """Solve the four by four triangle whose columns begin at p, q, r and s, in place."""
    ba, ca, da = values[at(p + 1)], values[at(p + 2)], values[at(p + 3)]
    cb, db, dc = values[at(q + 1)], values[at(q + 2)], values[at(r + 1)]
    for side in range(SIDES):
        a = t[side, at(j)] / values[at(p)]
        b = (t[side, at(j + 1)] - ba * a) / values[at(q)]
        c = (t[side, at(j + 2)] - ca * a - cb * b) / values[at(r)]
        d = (t[side, at(j + 3)] - da * a - db * b - dc * c) / values[at(s)]
        t[side, at(j)], t[side, at(j + 1)], t[side, at(j + 2)], t[side, at(j + 3)] = a, b, c, d


def upper_four(values, p, q, r, s, t, j):
    """Solve the transposed triangle in place."""
    ba, ca, da = values[at(p + 1)], values[at(p + 2)], values[at(p + 3)]
    cb, db, dc = values[at(q + 1)], values[at(q + 2)], values[at(r + 1)]
    for side in range(SIDES):
        d = t[side, at(j + 3)] / values[at(s)]
        c = (t[side, at(j + 2)] - dc * d) / values[at(r)]
        b = (t[side, at(j + 1)] - cb * c - db * d) / values[at(q)]
        a = (t[side, at(j)] - ba * b - ca * c - da * d) / values[at(p)]
        t[side, at(j)], t[side, at(j + 1)], t[side, at(j + 2)], t[side, at(j + 3)] = a, b, c, d
