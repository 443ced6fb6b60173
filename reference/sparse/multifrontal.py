"""Compute L of P A P' = L L' by the multifrontal method, supernode by supernode.

A supernode's columns of A and the updates that its children left are added into one dense front;
its columns are eliminated there and what remains is the update for its parent (Duff and Reid 1983,
"The Multifrontal Solution of Indefinite Sparse Symmetric Linear Systems"; Liu 1992, "The
Multifrontal Method for Sparse Matrix Solution: Theory and Practice"). Children come right before
their parents, so that the updates waiting form a stack.
"""

import numpy as np
from numpy import uint64 as at

from .dense import eliminate


def factorize(matrix, data, order, place, blocks, family, values):
    """Fill `values` with L's columns; return the first whose pivot is not positive, or -1."""
    work, stack = np.empty(blocks.tallest * blocks.tallest), np.empty(family.highest)
    columns, starts, rows = blocks.columns, blocks.starts, blocks.rows
    local, places = np.empty(len(order), np.int32), np.empty(blocks.tallest, np.int32)
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
        add_columns(matrix, data, order, place, first, last, local, front)
        for c in range(family.starts[s], family.starts[s + 1]):
            child = family.children[c]
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


def add_columns(matrix, data, order, place, first, last, local, front):
    """Add columns of the lower triangle of P A P' to a front."""
    for j in range(first, last):
        v, row = order[j], at(j - first)
        for e in range(matrix.indptr[v], matrix.indptr[v + 1]):
            i = place[at(matrix.indices[at(e)])]
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
    """Copy rows of a front from the diagonal on, one after the other; return where they end."""
    size = len(front)
    for j in range(first, last):
        for i in range(size - j):
            target[at(position + i)] = front[at(j), at(j + i)]
        position += size - j
    return position
