"""Symbolic analysis: the order P and the supernodes of P A P' = L L', from the pattern of A.

The parent of column j in the elimination tree is the first row below the diagonal of column j of L
(Liu 1990, "The Role of Elimination Trees in Sparse Factorization"). Supernodes are runs of columns
of L with a common pattern below them, stored and used as blocks. Fundamental supernodes follow from
parents and column counts (Ng and Peyton 1993, "Block Sparse Cholesky Algorithms on Advanced
Uniprocessor Computers"). Small supernodes are merged with their parents if few explicit zeros are
added (Ashcraft and Grimes 1989, "The Influence of Relaxed Supernode Partitions on the Multifrontal
Method").
"""

from typing import NamedTuple

import numpy as np

from .dissection import nested_dissection

# A merged supernode of at most so many columns may hold such a share of explicit zeros, the last
# share if wider. The shares decide speed alone, not a digit of the factor beyond rounding.
WIDTHS = (4, 16, 48)
ZERO_SHARES = (0.4, 0.15, 0.05, 0.02)


class Supernodes(NamedTuple):
    """The pattern of L in blocks."""

    columns: np.ndarray  # the first column of each supernode, and n; shape (supernode + 1,)
    starts: np.ndarray  # where the rows of each begin in `rows`, and their number; likewise
    rows: np.ndarray  # the rows below the diagonal blocks, ascending, supernode by supernode
    tallest: int  # number of rows of the tallest supernode, with its diagonal block


class UpdateTree(NamedTuple):
    """The updates to add into each front."""

    starts: np.ndarray  # where the children of each begin in `children`; shape (supernode + 1,)
    children: np.ndarray  # of each supernode, last first, as their updates lie on the stack
    highest: int  # the height of the stack of updates
    entries: int  # the number of entries of L


def analyse(graph, order):
    """Return the order of elimination, its inverse, the supernodes and their family.

    `order` lists all vertices of the graph, and is overwritten.
    """
    nested_dissection(graph, order)
    parents, counts = elimination_tree(graph, order, inverse(order))
    relabelling = postorder(parents)
    order, parents = composed(order, relabelling), relabelled(parents, relabelling)
    counts = composed(counts, relabelling)
    member = fundamental(parents, counts)
    relabelling, columns = gather(member, amalgamate(member, parents, counts))
    order, parents = composed(order, relabelling), relabelled(parents, relabelling)
    counts, place = composed(counts, relabelling), inverse(order)
    blocks, family = structure(graph, order, place, columns, parents, counts)
    return order, place, blocks, family


def inverse(order):
    """Return the place of each vertex in an order."""
    place = np.empty(len(order), np.int32)
    for i in range(len(order)):
        place[order[i]] = i
    return place


def composed(values, relabelling):
    """Return the values in another order."""
    result = np.empty(len(values), np.int32)
    for i in range(len(values)):
        result[i] = values[relabelling[i]]
    return result


def relabelled(parents, relabelling):
    """Return the parents after their nodes are put into another order, each before its parent."""
    place, result = inverse(relabelling), np.empty(len(parents), np.int32)
    for i in range(len(parents)):
        parent = parents[relabelling[i]]
        result[i] = place[parent] if parent >= 0 else -1
    return result


def elimination_tree(graph, order, place):
    """Return the parent of each column of P A P', -1 for a root, and the lengths of L's columns.

    Row i of L has entries in the columns of row i of A and in their ancestors up to i. Climbing
    from each column finds both (Davis 2005, "Algorithm 849: A Concise Sparse Cholesky Factorization
    Package"). `order` lists the vertices in order of elimination, `place` inverts the list.
    """
    n = len(order)
    parents, visited, counts = np.full(n, -1, np.int32), np.empty(n, np.int32), np.ones(n, np.int32)
    for i in range(n):
        visited[i] = i
        v = order[i]
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            k = place[graph.indices[e]]
            while k < i and visited[k] != i:
                visited[k] = i
                counts[k] += 1
                if parents[k] < 0:
                    parents[k] = i
                k = parents[k]
    return parents, counts


def postorder(parents):
    """Return the nodes of a forest so that every subtree is consecutive and ends in its root.

    Parents come after their children; entry -1 is the node above all roots.
    """
    n = len(parents)
    sizes, ends = np.ones(n + 1, np.int32), np.full(n + 1, n, np.int32)
    for j in range(n):
        sizes[parents[j]] += sizes[j]
    result = np.empty(n, np.int32)
    for j in range(n - 1, -1, -1):
        ends[j] = ends[parents[j]] - 1
        ends[parents[j]] -= sizes[j]
        result[ends[j]] = j
    return result


def entries(width, height):
    """Return the number of entries of the lower trapezoid of a block."""
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
    """Return the final supernode of each supernode."""
    count = member[-1] + 1 if len(member) > 0 else 0
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
    """Return an order in which merged supernodes are consecutive, and their first columns.

    Subtrees stay consecutive: a supernode comes where the last of its parts came.
    """
    count = len(target)
    sizes = np.zeros(count + 1, np.int32)
    for s in member:
        sizes[target[s] + 1] += 1
    merged_count = 0
    columns = np.zeros(count + 1, np.int32)
    for s in range(count):
        if sizes[s + 1] > 0:
            columns[merged_count] = sizes[s]
            merged_count += 1
        sizes[s + 1] += sizes[s]
    columns[merged_count] = len(member)
    order = np.empty(len(member), np.int32)
    for j in range(len(member)):
        s = target[member[j]]
        order[sizes[s]] = j
        sizes[s] += 1
    return order, columns[: merged_count + 1].copy()


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
    """Return the rows below each supernode, list after list.

    Row i of L reaches from the supernodes of its entries in A up to its own supernode. Running
    through the rows in order leaves every list sorted.
    """
    rows, filled = np.empty(starts[-1], np.int32), starts.copy()
    visited = np.full(len(above), -1, np.int32)
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
    """Return the children of each supernode, and the sizes of the updates and of L."""
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
    return UpdateTree(eldest, children, highest, total)
