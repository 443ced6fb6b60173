"""Supernodes: runs of columns of L with one common pattern below them, stored and used as blocks.

Fundamental supernodes are found from parents and column counts (Ng and Peyton 1993, "Block Sparse
Cholesky Algorithms on Advanced Uniprocessor Computers"). Small ones are merged with their parents
where that adds few explicit zeros (Ashcraft and Grimes 1989, "The Influence of Relaxed Supernode
Partitions on the Multifrontal Method").
"""

from typing import NamedTuple

import numpy as np

# A merged supernode of at most so many columns may hold such a share of explicit zeros.
WIDTHS = (4, 16, 48)
ZERO_SHARES = (0.4, 0.15, 0.05, 0.02)


class Supernodes(NamedTuple):
    """The pattern of L in blocks.

    Attributes:
        columns: the first column of each supernode, and n; shape (supernode + 1,).
        starts: where each one's rows begin in `rows`, and their number; shape (supernode + 1,).
        rows: the rows below the diagonal blocks, ascending, one supernode after the other.
        tallest: rows of the tallest supernode, the diagonal block's included.
    """

    columns: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    tallest: int


class Family(NamedTuple):
    """Which updates go into which front.

    Attributes:
        starts: where each supernode's children begin in `children`; shape (supernode + 1,).
        children: of each supernode, last one first, as their updates lie on the stack.
        highest: the height of the stack of updates.
        entries: how many entries L has.
    """

    starts: np.ndarray
    children: np.ndarray
    highest: int
    entries: int


def entries(width, height):
    """Return how many entries the lower trapezoid of a block has."""
    return width * height - width * (width - 1) // 2


def fundamental(parents, counts):
    """Return the supernode of each column, columns being in postorder."""
    n = len(parents)
    children = np.zeros(n, np.int32)
    for j in range(n):
        if parents[j] >= 0:
            children[parents[j]] += 1
    member = np.zeros(n, np.int32)
    for j in range(1, n):
        chained = parents[j - 1] == j and counts[j - 1] == counts[j] + 1 and children[j] == 1
        member[j] = member[j - 1] + (0 if chained else 1)
    return member


def amalgamate(member, parents, counts):
    """Return the supernode that each one merges into (or itself), itself not merged further."""
    count = 0
    for s in member:
        count = max(count, s + 1)
    last = np.zeros(count, np.int64)
    width, filled = np.zeros(count, np.int64), np.zeros(count, np.int64)
    for j in range(len(member)):
        last[member[j]] = j
        width[member[j]] += 1
        filled[member[j]] += counts[j]
    target = np.arange(count).astype(np.int32)
    for s in range(count):  # children come before their parents
        above = parents[last[s]]
        if above >= 0:
            p = member[above]
            together = width[s] + width[p]
            below = counts[last[p]] - 1
            zeros = entries(together, together + below) - filled[s] - filled[p]
            if zeros <= allowed(together) * entries(together, together + below):
                target[s] = p
                width[p], filled[p] = together, filled[s] + filled[p]
    for s in range(count - 1, -1, -1):
        target[s] = target[target[s]]
    return target


def allowed(width):
    """Return the share of explicit zeros that a supernode of a width may hold."""
    for i in range(len(WIDTHS)):
        if width <= WIDTHS[i]:
            return ZERO_SHARES[i]
    return ZERO_SHARES[-1]


def gather(member, target):
    """Return the columns so that those of a merged supernode are consecutive, and its first ones.

    Subtrees stay consecutive: a supernode comes where the last of its parts came.
    """
    count = len(target)
    sizes = np.zeros(count + 1, np.int32)
    for s in member:
        sizes[target[s] + 1] += 1
    kept = 0
    columns = np.zeros(count + 1, np.int32)
    for s in range(count):
        if sizes[s + 1] > 0:
            columns[kept] = sizes[s]
            kept += 1
        sizes[s + 1] += sizes[s]
    columns[kept] = len(member)
    order = np.empty(len(member), np.int32)
    for j in range(len(member)):
        s = target[member[j]]
        order[sizes[s]] = j
        sizes[s] += 1
    return order, columns[: kept + 1].copy()


def structure(graph, order, place, columns, parents, counts):
    """Return the supernodes with the rows below each, and their family."""
    count = len(columns) - 1
    member, above = np.empty(len(order), np.int32), np.empty(count, np.int32)
    starts, tallest = np.zeros(count + 1, np.int64), 0
    for s in range(count):
        below = counts[columns[s + 1] - 1] - 1
        starts[s + 1] = starts[s] + below
        tallest = max(tallest, columns[s + 1] - columns[s] + below)
        for j in range(columns[s], columns[s + 1]):
            member[j] = s
    for s in range(count):
        parent = parents[columns[s + 1] - 1]
        above[s] = member[parent] if parent >= 0 else -1
    rows = row_lists(graph, order, place, member, above, starts)
    return Supernodes(columns, starts, rows, tallest), family(columns, starts, above)


def row_lists(graph, order, place, member, above, starts):
    """Return the rows below each supernode, one list after the other.

    Row i of L reaches from the supernodes of its entries in A up to its own; running through the
    rows in order leaves every list sorted.
    """
    rows, filled = np.empty(starts[-1], np.int32), starts.copy()
    visited = np.empty(len(above), np.int32)
    for s in range(len(above)):
        visited[s] = -1
    for i in range(len(order)):
        visited[member[i]] = i
        v = order[i]
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            k = place[graph.indices[e]]
            if k < i:
                s = member[k]
                while visited[s] != i:
                    visited[s] = i
                    rows[filled[s]] = i
                    filled[s] += 1
                    s = above[s]
    return rows


def family(columns, starts, above):
    """Return the children of each supernode, and how many entries updates and L need."""
    count, total = len(above), 0
    eldest, children = np.zeros(count + 1, np.int64), np.empty(count, np.int32)
    waiting, top, highest = np.zeros(count, np.int64), 0, 0
    for s in range(count):
        width, below = columns[s + 1] - columns[s], starts[s + 1] - starts[s]
        update = below * (below + 1) // 2
        total += entries(width, width + below)
        top += update - waiting[s]
        highest = max(highest, top)
        if above[s] >= 0:
            waiting[above[s]] += update
            eldest[above[s] + 1] += 1
    for s in range(count):
        eldest[s + 1] += eldest[s]
    filled = eldest.copy()
    for s in range(count - 1, -1, -1):
        if above[s] >= 0:
            children[filled[above[s]]] = s
            filled[above[s]] += 1
    return Family(eldest, children, highest, total)
