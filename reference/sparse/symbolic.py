"""Symbolic analysis: the order P and the supernodes of P A P' = L L', from the pattern of A.

The parent of column j in the elimination tree is the first row below the diagonal of column j of L
(Liu 1990, "The Role of Elimination Trees in Sparse Factorization"). Supernodes are runs of columns
of L with a common pattern below them, stored and used as blocks. Fundamental supernodes follow from
parents and column counts (Ng and Peyton 1993, "Block Sparse Cholesky Algorithms on Advanced
Uniprocessor Computers"). Small supernodes are merged with their parents if few explicit zeros are
added (Ashcraft and Grimes 1989, "The Influence of Relaxed Supernode Partitions on the Multifrontal
Method").
"""

from typing import Any, NamedTuple

import numpy as np
import scipy

from ..backend.compiled import Kernel
from .dissection import Graph, nested_dissection

# A merged supernode of at most so many columns may hold such a share of explicit zeros, the last
# share if wider. The shares decide speed alone, not a digit of the factor beyond rounding.
WIDTHS = np.array([4, 16, 48])
ZERO_SHARES = np.array([0.4, 0.15, 0.05, 0.02])


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


class SymbolicFactor(NamedTuple):
    """The analysis of a symmetric pattern, shared by the factors of all matrices of the pattern."""

    graph: Graph
    order: np.ndarray  # of elimination
    place: np.ndarray  # of each vertex in the order
    blocks: Supernodes
    updates: UpdateTree


def analyse(graph: Graph) -> SymbolicFactor:
    """Order the columns and find L's pattern; a ValueError if A's is not symmetric."""
    n, (indptr, indices) = len(graph.indptr) - 1, graph
    pattern = scipy.sparse.csc_array((np.ones(len(indices), np.int8), indices, indptr), (n, n))
    if (pattern != pattern.T).nnz:
        raise ValueError("matrix: expected both triangles with the same pattern")
    order = nested_dissection(graph)
    parents, counts = _elimination_tree(graph, order, inverse(order))
    order, parents, counts = relabelled(_postorder(parents), order, parents, counts)
    columns = fundamental(parents, counts)
    member = np.repeat(amalgamated(columns, parents, counts), np.diff(columns))
    relabelling = np.argsort(member, kind="stable").astype(np.int32)
    columns = runs(np.diff(member[relabelling]) > 0, n)
    order, parents, counts = relabelled(relabelling, order, parents, counts)
    blocks, updates = structure(graph, order, columns, parents, counts)
    return SymbolicFactor(graph, order, inverse(order), blocks, updates)


def inverse(order: Any) -> Any:
    """Return the place of each vertex in an order."""
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return place


def relabelled(relabelling: Any, order: Any, parents: Any, counts: Any) -> tuple[Any, Any, Any]:
    """Return all three for columns in another order, each before its parent."""
    above = np.append(inverse(relabelling), np.int32(-1))[parents[relabelling]]
    return order[relabelling], above, counts[relabelling]


def runs(begins: Any, n: int) -> Any:
    """Return where runs of columns begin, and n, from whether columns 1 to n - 1 begin a run."""
    return np.concatenate([np.arange(min(n, 1)), np.flatnonzero(begins) + 1, [n]]).astype(np.int32)


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


def fundamental(parents: Any, counts: Any) -> Any:
    """Return the first column of each supernode, and n, columns being in postorder."""
    n = len(parents)
    children = np.bincount(parents[parents >= 0], minlength=n)
    chained = (parents[:-1] == np.arange(1, n)) & (counts[:-1] == counts[1:] + 1)
    return runs(~chained | (children[1:] != 1), n)


def supernode_tree(columns: Any, parents: Any) -> tuple[Any, Any]:
    """Return the supernode of each column, and the parent of each supernode, -1 for a root."""
    member = np.repeat(np.arange(len(columns) - 1, dtype=np.int32), np.diff(columns))
    return member, np.append(member, np.int32(-1))[parents[columns[1:] - 1]]


def amalgamated(columns: Any, parents: Any, counts: Any) -> Any:
    """Return the final supernode of each fundamental supernode."""
    _, above = supernode_tree(columns, parents)
    filled = np.add.reduceat(counts, columns[:-1], dtype=np.int64)
    below = counts[columns[1:] - 1].astype(np.int64) - 1
    return _amalgamate(above, np.diff(columns).astype(np.int64), below, filled)


def amalgamate(above, width, below, filled):
    """Return the final supernode of each supernode; widths and entries are overwritten."""
    target = np.arange(len(above)).astype(np.int32)
    for s in range(len(above)):  # children come before their parents
        p = above[s]
        if p >= 0:
            together = width[s] + width[p]
            size = entries(together, together + below[p])
            zeros = size - filled[s] - filled[p]
            if zeros <= ZERO_SHARES[np.searchsorted(WIDTHS, together)] * size:
                target[s] = p
                width[p], filled[p] = together, filled[s] + filled[p]
    for s in range(len(above) - 1, -1, -1):
        target[s] = target[target[s]]
    return target


def structure(
    graph: Graph, order: Any, columns: Any, parents: Any, counts: Any
) -> tuple[Supernodes, UpdateTree]:
    """Return the supernodes with the rows below each, and the tree of their updates."""
    width, below = np.diff(columns), counts[columns[1:] - 1].astype(np.int64) - 1
    starts, (member, above) = ends(below), supernode_tree(columns, parents)
    rows = _row_lists(graph, order, inverse(order), member, above, starts)
    updates = below * (below + 1) // 2
    children = np.flatnonzero(above >= 0)[::-1]
    children = children[np.argsort(above[children], kind="stable")].astype(np.int32)
    consumed = np.bincount(above[children], updates[children], len(above)).astype(np.int64)
    tree = UpdateTree(
        ends(np.bincount(above[children], minlength=len(above))),
        children,
        highest=int(np.cumsum(updates - consumed).max(initial=0)),
        entries=int(entries(width, width + below).sum()),
    )
    return Supernodes(columns, starts, rows, int((width + below).max(initial=0))), tree


def ends(lengths: Any) -> Any:
    """Return where lists of these lengths begin, one after the other, and the end of the last."""
    return np.append(0, np.cumsum(lengths))


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


_elimination_tree = Kernel(elimination_tree)
_postorder = Kernel(postorder)
_amalgamate = Kernel(amalgamate)
_row_lists = Kernel(row_lists)
