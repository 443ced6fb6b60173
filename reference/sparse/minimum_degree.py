"""Minimum degree on a small piece of a graph, its surroundings included.

Eliminating a vertex joins all its neighbours; the vertex with the fewest goes first (Tinney and
Walker 1967, "Direct Solutions of Sparse Network Equations by Optimally Ordered Triangular
Factorization"). The neighbours outside of the piece are eliminated later but count: without this
halo (Pellegrini, Roman, Amestoy 2000, "Hybridizing Nested Dissection and Halo Approximate Minimum
Degree") the vertices on a piece's rim would always seem to have the least degree.
"""

import numpy as np


def minimum_degree(graph, piece, local):
    """Reorder the vertices of a piece in place; `local` is -1 everywhere, before and after.

    Of several vertices of least degree, the one goes first that has not changed for longest: so
    elimination moves about, as it does where many are eliminated at once (Liu 1985, "Modification
    of the Minimum-Degree Algorithm by Multiple Elimination").
    """
    joined = adjacency(graph, piece, local)
    count, width = joined.shape
    vertices, ranks = np.empty(count, np.int32), np.zeros(count, np.int64)
    for v in range(count):
        vertices[v] = piece[v]
        for u in range(width):
            ranks[v] += int(joined[v, u])
        ranks[v] *= count + 1
    for position in range(count):
        least = 0
        for v in range(count):
            if ranks[v] < ranks[least]:
                least = v
        piece[position] = vertices[least]
        eliminate(joined, ranks, least, position + 1)
        ranks[least] = (width + 1) * (count + 1)  # never the least again


def adjacency(graph, piece, local):
    """Return which vertex of the piece neighbours which of piece and halo, as zeros and ones."""
    count, entries = len(piece), 0
    for i in range(count):
        local[piece[i]] = i
        entries += graph.indptr[piece[i] + 1] - graph.indptr[piece[i]]
    halo, width = np.empty(entries, np.int32), count
    for v in piece:
        for u in graph.indices[graph.indptr[v] : graph.indptr[v + 1]]:
            if local[u] < 0:
                local[u], halo[width - count] = width, u
                width += 1
    joined = np.zeros((count, width), np.uint8)
    for i in range(count):
        for u in graph.indices[graph.indptr[piece[i]] : graph.indptr[piece[i] + 1]]:
            joined[i, local[u]] = 1
        joined[i, i] = 0
    for v in piece:
        local[v] = -1
    for v in halo[: width - count]:
        local[v] = -1
    return joined


def eliminate(joined, ranks, v, now):
    """Join all neighbours of v and take it out; their ranks are degree, then time of change."""
    count, width = joined.shape
    for u in range(count):
        if joined[v, u]:
            degree = 0
            for w in range(width):
                joined[u, w] |= joined[v, w]
                degree += int(joined[u, w])
            joined[u, u] = joined[u, v] = 0
            ranks[u] = (degree - 2) * (count + 1) + now
