"""Compute L of P A P' = L L' by the multifrontal method, supernode by supernode.

A supernode's columns of A and its children's updates are added into a dense front. The columns are
eliminated there, and the remainder is the update for the parent (Duff and Reid 1983, "The
Multifrontal Solution of Indefinite Sparse Symmetric Linear Systems"; Liu 1992, "The Multifrontal
Method for Sparse Matrix Solution: Theory and Practice"). Children come right before their parents:
the pending updates form a stack.

Row j of a front holds column j of the lower triangle, from the diagonal on: elimination runs along
rows. Indices are made unsigned (`at`) for the reason given in `triangular`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy import uint64 as at

from ..backend.compiled import relaxed, uncounted

PANEL = 64  # rows eliminated one by one before the rest is updated
SMALLEST = float(np.finfo(np.float32).tiny)  # a subnormal number takes longer to read
STRIP = 256  # columns updated together, so that those of a panel stay in a near cache


class Scratch(NamedTuple):
    """What a factorisation writes to."""

    front: np.ndarray  # the square of the tallest front
    stack: np.ndarray  # of updates
    local: np.ndarray  # the place of each row in the front
    places: np.ndarray  # in the front, of the rows of an update


def scratch_for(blocks, updates, n):
    """Return the scratch to factorise a matrix of n rows."""
    return Scratch(
        np.empty(blocks.tallest * blocks.tallest),
        np.empty(updates.highest),
        np.empty(n, np.int32),
        np.empty(blocks.tallest, np.int32),
    )


@relaxed
@uncounted
def factorize(pattern, data, values, scratch):
    """Fill `values` with L's columns; return the first without a positive pivot, or -1."""
    graph, order, place, blocks, updates = pattern
    work, stack, local, places = scratch
    columns, starts, rows = blocks.columns, blocks.starts, blocks.rows
    top, filled = 0, 0
    for s in range(len(columns) - 1):
        first, last = columns[s], columns[s + 1]
        width = last - first
        size = width + starts[s + 1] - starts[s]
        front = work[: size * size].reshape((size, size))
        for j in range(size):
            # Four rows are eliminated from together, which also touches three before the diagonal.
            for i in range(max(j - 3, 0), size):
                front[at(j), at(i)] = 0.0
        for j in range(width):
            local[first + j] = j
        for i in range(width, size):
            local[rows[starts[s] + i - width]] = i
        add_columns(graph, data, order, place, first, last, local, front)
        for c in range(updates.starts[s], updates.starts[s + 1]):
            child = updates.children[c]
            count = starts[child + 1] - starts[child]
            for i in range(count):
                places[i] = local[rows[starts[child] + i]]
            top -= count * (count + 1) // 2
            add_update(stack, top, places, count, front)
        failed = eliminate(front, width)
        if failed >= 0:
            return first + failed
        filled = store(front, 0, width, values, filled)
        top = store(front, width, size, stack, top)
    return -1


def add_columns(graph, data, order, place, first, last, local, front):
    """Add columns of the lower triangle of P A P' to a front."""
    for j in range(first, last):
        v, row = order[j], at(j - first)
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            i = place[at(graph.indices[at(e)])]
            if i >= j:
                front[row, at(local[at(i)])] += data[at(e)]


def add_update(stack, position, places, count, front):
    """Add an update, `count` rows from `position` on, to the places of a front."""
    for j in range(count):
        row = at(places[at(j)])
        for i in range(count - j):
            front[row, at(places[at(j + i)])] += stack[at(position + i)]
        position += count - j


def store(front, first, last, target, position):
    """Copy rows of a front from the diagonal on into consecutive places; return their end."""
    size = len(front)
    for j in range(first, last):
        for i in range(size - j):
            target[at(position + i)] = front[at(j), at(j + i)]
        position += size - j
    return position


def eliminate(front, width):
    """Eliminate the first rows of a front; return the first without a positive pivot, or -1."""
    size = len(front)
    for first in range(0, width, PANEL):
        last = min(first + PANEL, width)
        failed = eliminate_panel(front, first, last)
        if failed >= 0:
            return failed
        for begin in range(last, size, STRIP):
            end = min(begin + STRIP, size)
            k = last
            while k + 4 <= end:
                subtract_from_four(front, first, last, k, max(begin, k), end)
                k += 4
            while k < end:
                subtract_from_one(front, first, last, k, max(begin, k), end)
                k += 1
    return -1


def eliminate_panel(front, first, last):
    """Eliminate rows from each other; return the first without a positive pivot, or -1."""
    size = len(front)
    for j in range(first, last):
        subtract_from_one(front, first, j, j, j, size)
        pivot = front[at(j), at(j)]
        if not (pivot > 0.0 and pivot < math.inf):
            return j
        pivot = math.sqrt(pivot)
        front[at(j), at(j)] = pivot
        inverse = 1.0 / pivot
        for i in range(j + 1, size):
            front[at(j), at(i)] *= inverse
    return -1


def subtract_from_one(front, first, last, k, begin, end):
    """Subtract the products with rows `first` to `last` from row k, columns `begin` to `end`."""
    row, j = at(k), first
    while j + 4 <= last:
        A, B, C, D = at(j), at(j + 1), at(j + 2), at(j + 3)
        a, b, c, d = front[A, row], front[B, row], front[C, row], front[D, row]
        for column in range(begin, end):
            i = at(column)
            front[row, i] -= a * front[A, i] + b * front[B, i] + c * front[C, i] + d * front[D, i]
        j += 4
    while j < last:
        A = at(j)
        a = front[A, row]
        for column in range(begin, end):
            front[row, at(column)] -= a * front[A, at(column)]
        j += 1


def subtract_from_four(front, first, last, k, begin, end):
    """Do the same as `subtract_from_one` for rows k to k + 3, with a quarter of the loads."""
    k0, k1, k2, k3, j = at(k), at(k + 1), at(k + 2), at(k + 3), first
    while j + 4 <= last:
        A, B, C, D = at(j), at(j + 1), at(j + 2), at(j + 3)
        a0, a1, a2, a3 = front[A, k0], front[A, k1], front[A, k2], front[A, k3]
        b0, b1, b2, b3 = front[B, k0], front[B, k1], front[B, k2], front[B, k3]
        c0, c1, c2, c3 = front[C, k0], front[C, k1], front[C, k2], front[C, k3]
        d0, d1, d2, d3 = front[D, k0], front[D, k1], front[D, k2], front[D, k3]
        for column in range(begin, end):
            i = at(column)
            a, b, c, d = front[A, i], front[B, i], front[C, i], front[D, i]
            front[k0, i] -= a0 * a + b0 * b + c0 * c + d0 * d
            front[k1, i] -= a1 * a + b1 * b + c1 * c + d1 * d
            front[k2, i] -= a2 * a + b2 * b + c2 * c + d2 * d
            front[k3, i] -= a3 * a + b3 * b + c3 * c + d3 * d
        j += 4
    while j < last:
        A = at(j)
        a0, a1, a2, a3 = front[A, k0], front[A, k1], front[A, k2], front[A, k3]
        for column in range(begin, end):
            i = at(column)
            a = front[A, i]
            front[k0, i] -= a0 * a
            front[k1, i] -= a1 * a
            front[k2, i] -= a2 * a
            front[k3, i] -= a3 * a
        j += 1


def round_entries(values, rounded):
    """Round entries to single precision, below SMALLEST to zero; return the largest size."""
    largest = 0.0
    for i in range(len(values)):
        size = abs(values[i])
        rounded[i] = values[i] if size >= SMALLEST else 0.0
        largest = max(largest, size)
    return largest
