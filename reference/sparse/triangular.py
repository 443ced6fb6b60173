"""Solve L L' x = b by forward and backward substitution, three right-hand sides together.

L is read once in its stored order, and once in reverse.

Three right-hand sides go through together, in the lanes of a vector register: L comes from memory
once for all three. Four columns go through at a time: unknowns come from the cache once for four.

Indices are made unsigned (`at`) where speed matters: the test for a negative index takes as long as
the arithmetic.
"""

from typing import NamedTuple

import numpy as np
from numpy import uint64 as at

from ..backend.compiled import relaxed
from ..backend.simd.vectors import load_row, prefetch, scale_row, store_row, subtract_scaled

# Right-hand sides solved together, and the doubles of a register with an unknown of each.
RIGHT_HAND_SIDES, REGISTER = 3, 4
# Entries of L are prefetched so far ahead of their use, row by row: prefetched many at a time they
# keep the arithmetic waiting.
AHEAD = 4096


@relaxed
def solve(order, columns, starts, rows, values, b, y, x):
    """Solve A x = b for three right-hand sides: fill x, (n, 3); y is workspace, (n, 4).

    The arguments are the fields of `Supernodes`: passing a tuple takes longer than solving a
    small system.
    """
    p = starts[0]
    for j in range(len(order)):
        v = order[j]
        y[j, 0], y[j, 1], y[j, 2], y[j, 3] = b[v, 0], b[v, 1], b[v, 2], 0.0
    for s in range(len(columns) - 1):
        below = Below(rows, starts[s], starts[s + 1] - starts[s])
        p = eliminate(values, p, columns[s], columns[s + 1], below, y)
    for s in range(len(columns) - 2, -1, -1):
        below = Below(rows, starts[s], starts[s + 1] - starts[s])
        p = substitute(values, p, columns[s], columns[s + 1], below, y)
    for j in range(len(order)):
        v = order[j]
        x[v, 0], x[v, 1], x[v, 2] = y[j, 0], y[j, 1], y[j, 2]


class Below(NamedTuple):
    """The rows below a supernode's diagonal block: so many of `rows` from `start` on."""

    rows: np.ndarray
    start: int
    length: int


def row_below(below, i):
    """Return the i-th of the rows below."""
    return at(below.rows[at(below.start + i)])


def eliminate(values, p, first, last, below, y):
    """Solve for the unknowns of a supernode and subtract their terms from the rows below.

    The columns of the supernode begin at p in `values`; return their end.
    """
    j = first
    while j + 4 <= last:
        size = last - j + below.length
        p = eliminate_four(values, p, size, j, last, below, y)
        j += 4
    while j < last:
        a = scale_row(1.0 / float(values[at(p)]), load_row(y, at(j)))
        store_row(y, at(j), a)
        p += 1
        for i in range(j + 1, last):
            store_row(y, at(i), subtract_scaled(load_row(y, at(i)), values[at(p)], a))
            p += 1
        for i in range(below.length):
            row = row_below(below, i)
            store_row(y, row, subtract_scaled(load_row(y, row), values[at(p)], a))
            p += 1
        j += 1
    return p


def substitute(values, p, first, last, below, y):
    """Solve for the unknowns of a supernode when all unknowns below are known.

    The columns of the supernode end at p in `values`; return their beginning.
    """
    j = last
    while (j - first) % 4 > 0:
        j -= 1
        p -= last - j + below.length
        a, q = load_row(y, at(j)), p + 1
        for i in range(j + 1, last):
            a = subtract_scaled(a, values[at(q)], load_row(y, at(i)))
            q += 1
        for i in range(below.length):
            a = subtract_scaled(a, values[at(q)], load_row(y, row_below(below, i)))
            q += 1
        store_row(y, at(j), scale_row(1.0 / float(values[at(p)]), a))
    while j > first:
        j -= 4
        size = last - j + below.length
        p -= 4 * size - 6
        substitute_four(values, p, size, j, last, below, y)
    return p


def four_columns(p, size):
    """Return the beginnings of four columns, the first of `size` entries at p."""
    return p, p + size, p + 2 * size - 1, p + 3 * size - 3


def subtract_four(z, values, p, q, r, s, rows):
    """Return a row minus four scaled rows, scaled by the values at p, q, r and s."""
    a, b, c, d = rows
    z = subtract_scaled(subtract_scaled(z, values[at(p)], a), values[at(q)], b)
    return subtract_scaled(subtract_scaled(z, values[at(r)], c), values[at(s)], d)


def eliminate_four(values, p, size, j, last, below, y):
    """Do the same as `eliminate` for columns j to j + 3; return where they end."""
    ahead = p + AHEAD
    p, q, r, s = four_columns(p, size)
    a = scale_row(1.0 / float(values[at(p)]), load_row(y, at(j)))
    b = subtract_scaled(load_row(y, at(j + 1)), values[at(p + 1)], a)
    b = scale_row(1.0 / float(values[at(q)]), b)
    c = subtract_scaled(load_row(y, at(j + 2)), values[at(p + 2)], a)
    c = scale_row(1.0 / float(values[at(r)]), subtract_scaled(c, values[at(q + 1)], b))
    d = subtract_scaled(load_row(y, at(j + 3)), values[at(p + 3)], a)
    d = subtract_scaled(d, values[at(q + 2)], b)
    d = scale_row(1.0 / float(values[at(s)]), subtract_scaled(d, values[at(r + 1)], c))
    store_row(y, at(j), a)
    store_row(y, at(j + 1), b)
    store_row(y, at(j + 2), c)
    store_row(y, at(j + 3), d)
    p, q, r, s, rows = p + 4, q + 3, r + 2, s + 1, (a, b, c, d)
    for i in range(last - j - 4):
        row = at(j + 4 + i)
        z = load_row(y, row)
        store_row(y, row, subtract_four(z, values, p + i, q + i, r + i, s + i, rows))
    k = last - j - 4
    p, q, r, s = p + k, q + k, r + k, s + k
    for i in range(below.length):
        prefetch(values, ahead + 4 * i)
        row = row_below(below, i)
        z = load_row(y, row)
        store_row(y, row, subtract_four(z, values, p + i, q + i, r + i, s + i, rows))
    return s + below.length


def substitute_four(values, p, size, j, last, below, y):
    """Do the same as `substitute` for columns j to j + 3."""
    ahead = p - AHEAD
    p, q, r, s = four_columns(p, size)
    a, b = load_row(y, at(j)), load_row(y, at(j + 1))
    c, d = load_row(y, at(j + 2)), load_row(y, at(j + 3))
    for i in range(4, last - j):
        z = load_row(y, at(j + i))
        a = subtract_scaled(a, values[at(p + i)], z)
        b = subtract_scaled(b, values[at(q + i - 1)], z)
        c = subtract_scaled(c, values[at(r + i - 2)], z)
        d = subtract_scaled(d, values[at(s + i - 3)], z)
    k = last - j
    for i in range(below.length):
        prefetch(values, ahead + 4 * i)
        z = load_row(y, row_below(below, i))
        a = subtract_scaled(a, values[at(p + k + i)], z)
        b = subtract_scaled(b, values[at(q + k - 1 + i)], z)
        c = subtract_scaled(c, values[at(r + k - 2 + i)], z)
        d = subtract_scaled(d, values[at(s + k - 3 + i)], z)
    d = scale_row(1.0 / float(values[at(s)]), d)
    c = scale_row(1.0 / float(values[at(r)]), subtract_scaled(c, values[at(r + 1)], d))
    b = subtract_scaled(subtract_scaled(b, values[at(q + 1)], c), values[at(q + 2)], d)
    b = scale_row(1.0 / float(values[at(q)]), b)
    a = subtract_scaled(subtract_scaled(a, values[at(p + 1)], b), values[at(p + 2)], c)
    a = scale_row(1.0 / float(values[at(p)]), subtract_scaled(a, values[at(p + 3)], d))
    store_row(y, at(j), a)
    store_row(y, at(j + 1), b)
    store_row(y, at(j + 2), c)
    store_row(y, at(j + 3), d)
