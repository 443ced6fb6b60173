"""The elimination tree of a symmetric pattern, its postorder, and how long L's columns are.

The parent of column j is the first row below the diagonal of column j of L: the column that j's
elimination changes first (Liu 1990, "The Role of Elimination Trees in Sparse Factorization").
"""

import numpy as np


def elimination_tree(graph, order, place):
    """Return the parent of each column of P A P', -1 for a root (Liu 1990, algorithm 4.2).

    `order` lists the vertices as they are eliminated, and `place` is its inverse.
    """
    n = len(order)
    parents, ancestors = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    for i in range(n):
        v = order[i]
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            k = place[graph.indices[e]]
            while k >= 0 and k < i:  # climb to the root, and let the path point at i
                above = ancestors[k]
                ancestors[k] = i
                if above < 0:
                    parents[k] = i
                k = above
    return parents


def postorder(parents):
    """Return the nodes of a forest so that every subtree is consecutive and ends in its root."""
    n = len(parents)
    eldest, sibling = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    for j in range(n - 1, -1, -1):
        if parents[j] >= 0:
            sibling[j], eldest[parents[j]] = eldest[parents[j]], j
    result, path, done = np.empty(n, np.int32), np.empty(n, np.int32), 0
    for root in range(n):
        if parents[root] >= 0:
            continue
        path[0], depth = root, 1
        while depth > 0:
            j = path[depth - 1]
            child = eldest[j]
            if child >= 0:
                eldest[j] = sibling[child]
                path[depth] = child
                depth += 1
            else:
                result[done] = j
                done, depth = done + 1, depth - 1
    return result


def column_counts(graph, order, place, parents):
    """Return the number of entries in each column of L, the diagonal included.

    The nodes are in postorder. Row i of L is the subtree of the nodes k with a_ik not zero and
    their ancestors up to i; adding up over all rows, each leaf of a subtree counts one and each
    meeting of two paths subtracts one (Gilbert, Ng, Peyton 1994, "An Efficient Algorithm to
    Compute Row and Column Counts for Sparse Cholesky Factorization").
    """
    n = len(order)
    first, counts = first_descendants(parents)
    last_leaf, latest = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    joined = np.arange(n).astype(np.int32)
    for j in range(n):
        if parents[j] >= 0:
            counts[parents[j]] -= 1
        v = order[j]
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            i = place[graph.indices[e]]
            if i > j and first[j] > latest[i]:  # j is a leaf of row i's subtree
                counts[j] += 1
                if last_leaf[i] >= 0:
                    counts[meeting(joined, last_leaf[i])] -= 1
                last_leaf[i] = j
            if i > j:
                latest[i] = max(latest[i], first[j])
        if parents[j] >= 0:
            joined[j] = parents[j]
    for j in range(n):
        if parents[j] >= 0:
            counts[parents[j]] += counts[j]
    return counts


def first_descendants(parents):
    """Return the first node of each subtree in postorder, and one for each leaf, else zero."""
    n = len(parents)
    first, counts = np.arange(n).astype(np.int32), np.ones(n, np.int32)
    for j in range(n):
        if parents[j] >= 0:
            counts[parents[j]] = 0
            first[parents[j]] = min(first[parents[j]], first[j])
    return first, counts


def meeting(joined, leaf):
    """Return the present root of a node's tree, and let the path to it point there."""
    root = leaf
    while joined[root] != root:
        root = joined[root]
    while leaf != root:
        above = joined[leaf]
        joined[leaf] = root
        leaf = above
    return root
