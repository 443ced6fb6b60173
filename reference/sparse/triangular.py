"""Forward and backward substitution: L is read once in the order it is stored, once in reverse.

Three right-hand sides go through together, in the lanes of a vector register, so that L comes from
memory once for all of them; and four columns at a time, so that the unknowns come from the cache
once for all of these.

Indices are made unsigned (`at`) where speed matters: the test for a negative index takes as long as
the arithmetic.
"""

from typing import NamedTuple

import numpy as np
from numpy import uint64 as at

from ..backend.simd.rows import ask_for, less, put_row, row_at, scaled

SIDES, LANES = 3, 4
# A longer L does not stay in a near cache, and is asked for so many entries ahead.
NEAR, AHEAD = 2**20, 1024
LINE = 8  # entries that come from memory together


def solve(order, columns, starts, rows, values, b, y, x):
    """Set x to the solution of A x = b, three right-hand sides, shape (n, 3); y is room, (n, 4).

    The arguments are those of `Supernodes`, one by one: a tuple takes longer to hand over than a
    small system to solve.
    """
    p, ahead = starts[0], AHEAD if len(values) > NEAR else 0
    for j in range(len(order)):
        v = order[j]
        y[j, 0], y[j, 1], y[j, 2], y[j, 3] = b[v, 0], b[v, 1], b[v, 2], 0.0
    for s in range(len(columns) - 1):
        below = Below(rows, starts[s], starts[s + 1] - starts[s])
        p = eliminate(values, p, columns[s], columns[s + 1], below, y, ahead)
    for s in range(len(columns) - 2, -1, -1):
        below = Below(rows, starts[s], starts[s + 1] - starts[s])
        p = substitute(values, p, columns[s], columns[s + 1], below, y, ahead)
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


def eliminate(values, p, first, last, below, y, ahead):
    """Solve for the unknowns of a supernode; take what follows from them off those below.

    Its columns begin at p in `values`; return where they end.
    """
    j = first
    while j + 4 <= last:
        size = last - j + below.length
        if ahead > 0:
            ask_for_columns(values, p + ahead, size)
        p = eliminate_four(values, p, size, j, last, below, y)
        j += 4
    while j < last:
        a = scaled(1.0 / values[at(p)], row_at(y, at(j)))
        put_row(y, at(j), a)
        p += 1
        for i in range(j + 1, last):
            put_row(y, at(i), less(row_at(y, at(i)), values[at(p)], a))
            p += 1
        for i in range(below.length):
            row = row_below(below, i)
            put_row(y, row, less(row_at(y, row), values[at(p)], a))
            p += 1
        j += 1
    return p


def substitute(values, p, first, last, below, y, ahead):
    """Solve for the unknowns of a supernode, all those below being known.

    Its columns end at p in `values`; return where they begin.
    """
    j = last
    while (j - first) % 4 > 0:
        j -= 1
        p -= last - j + below.length
        a, q = row_at(y, at(j)), p + 1
        for i in range(j + 1, last):
            a = less(a, values[at(q)], row_at(y, at(i)))
            q += 1
        for i in range(below.length):
            a = less(a, values[at(q)], row_at(y, row_below(below, i)))
            q += 1
        put_row(y, at(j), scaled(1.0 / values[at(p)], a))
    while j > first:
        j -= 4
        size = last - j + below.length
        p -= 4 * size - 6
        if ahead > 0:
            ask_for_columns(values, p - ahead, size)
        substitute_four(values, p, size, j, last, below, y)
    return p


def ask_for_columns(values, p, size):
    """Ask memory for four columns from p on."""
    for i in range(0, 4 * size, LINE):
        ask_for(values, p + i)


def four_columns(p, size):
    """Return where four columns begin, the first of them, of `size` entries, at p."""
    return p, p + size, p + 2 * size - 1, p + 3 * size - 3


def eliminate_four(values, p, size, j, last, below, y):
    """Do what `eliminate` does for columns j to j + 3; return where they end."""
    p, q, r, s = four_columns(p, size)
    a = row_at(y, at(j))
    a = scaled(1.0 / values[at(p)], a)
    b = less(row_at(y, at(j + 1)), values[at(p + 1)], a)
    b = scaled(1.0 / values[at(q)], b)
    c = less(less(row_at(y, at(j + 2)), values[at(p + 2)], a), values[at(q + 1)], b)
    c = scaled(1.0 / values[at(r)], c)
    d = less(less(row_at(y, at(j + 3)), values[at(p + 3)], a), values[at(q + 2)], b)
    d = scaled(1.0 / values[at(s)], less(d, values[at(r + 1)], c))
    put_row(y, at(j), a)
    put_row(y, at(j + 1), b)
    put_row(y, at(j + 2), c)
    put_row(y, at(j + 3), d)
    p, q, r, s = p + 4, q + 3, r + 2, s + 1
    for i in range(last - j - 4):
        row = at(j + 4 + i)
        z = less(less(row_at(y, row), values[at(p + i)], a), values[at(q + i)], b)
        put_row(y, row, less(less(z, values[at(r + i)], c), values[at(s + i)], d))
    k = last - j - 4
    p, q, r, s = p + k, q + k, r + k, s + k
    for i in range(below.length):
        row = row_below(below, i)
        z = less(less(row_at(y, row), values[at(p + i)], a), values[at(q + i)], b)
        put_row(y, row, less(less(z, values[at(r + i)], c), values[at(s + i)], d))
    return s + below.length


def substitute_four(values, p, size, j, last, below, y):
    """Do what `substitute` does for columns j to j + 3."""
    p, q, r, s = four_columns(p, size)
    a, b, c, d = row_at(y, at(j)), row_at(y, at(j + 1)), row_at(y, at(j + 2)), row_at(y, at(j + 3))
    for i in range(last - j - 4):
        z = row_at(y, at(j + 4 + i))
        a, b = less(a, values[at(p + 4 + i)], z), less(b, values[at(q + 3 + i)], z)
        c, d = less(c, values[at(r + 2 + i)], z), less(d, values[at(s + 1 + i)], z)
    k = last - j
    for i in range(below.length):
        z = row_at(y, row_below(below, i))
        a, b = less(a, values[at(p + k + i)], z), less(b, values[at(q + k - 1 + i)], z)
        c, d = less(c, values[at(r + k - 2 + i)], z), less(d, values[at(s + k - 3 + i)], z)
    d = scaled(1.0 / values[at(s)], d)
    c = scaled(1.0 / values[at(r)], less(c, values[at(r + 1)], d))
    b = less(less(b, values[at(q + 1)], c), values[at(q + 2)], d)
    b = scaled(1.0 / values[at(q)], b)
    a = less(less(less(a, values[at(p + 1)], b), values[at(p + 2)], c), values[at(p + 3)], d)
    put_row(y, at(j), scaled(1.0 / values[at(p)], a))
    put_row(y, at(j + 1), b)
    put_row(y, at(j + 2), c)
    put_row(y, at(j + 3), d)
