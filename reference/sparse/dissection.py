"""Nested dissection: an order of elimination that leaves little fill, from the graph only.

A separator is eliminated after both halves that it parts, and so on inside of the halves (George
1973, "Nested Dissection of a Regular Finite Element Mesh"). Here separators are level sets of a
few coordinates, which breadth-first searches find: with a and b far apart, dist(v, a) - dist(v, b)
grows evenly from a to b, and its level sets run straight across, where those of one distance bend.
Whatever the threshold t of a coordinate f, the vertices with f >= t that have a neighbour with
f < t are a separator, and one sweep over the edges counts them for every t.
"""

import math
from typing import NamedTuple

import numpy as np

from .minimum_degree import minimum_degree

LEAF = 20  # pieces of at most so many vertices are ordered by minimum degree
HARD = 2000  # so are pieces of at most so many vertices that have no good separator
LEAST_SHARE = 0.2  # of a piece: what the smaller half must have
LARGEST_SHARE = 0.3  # of a piece: what a good separator may have
AXES = 4  # coordinates of a vertex
GONE = 2**30  # the coordinates of a vertex in a separator


class Graph(NamedTuple):
    """The neighbours of vertex v are indices[indptr[v]:indptr[v + 1]]; v itself may be one."""

    indptr: np.ndarray
    indices: np.ndarray


class Search(NamedTuple):
    """What the searches write and the splits read.

    Attributes:
        region: the piece that a vertex belongs to; each search moves what it reaches one further.
        axes: the coordinates, shape (axis, vertex).
        queue: the vertices in the order reached.
        lowest: the least coordinate among a vertex and its neighbours.
    """

    region: np.ndarray
    axes: np.ndarray
    queue: np.ndarray
    lowest: np.ndarray


def nested_dissection(graph, order):
    """Reorder the vertices in `order` in place, so that eliminating them leaves little fill."""
    n = len(order)
    local = np.full(n, -1, np.int32)
    search = Search(
        np.zeros(n, np.int32),
        np.zeros((AXES, n), np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
    )
    pieces = np.empty((n + 2, 3), np.int32)  # first, last + 1 in order; whether it has coordinates
    waiting = push(pieces, 0, 0, postpone_hubs(graph, search, order), 0)
    region = 0
    while waiting > 0:
        waiting -= 1
        first, last, measured = pieces[waiting, 0], pieces[waiting, 1], pieces[waiting, 2]
        piece = order[first:last]
        if len(piece) <= LEAF:
            minimum_degree(graph, piece, local)
            continue
        if not measured:
            region = enter(search, piece, region + 1)
            if breadth_first(graph, search, region, piece[0], 0, 0) < len(piece):
                region = enter(search, piece, region + 2)
                waiting = push_components(graph, search, region, piece, first, pieces, waiting)
                region += 1
                continue
            region = measure(graph, search, region + 1, piece)
        left, right = split(graph, search, piece)
        if left > 0:
            waiting = push(pieces, waiting, first, first + left, 1)
            waiting = push(pieces, waiting, first + left, first + left + right, 1)
        elif measured:
            waiting = push(pieces, waiting, first, last, 0)
        elif len(piece) <= HARD:
            minimum_degree(graph, piece, local)


def push(pieces, waiting, first, last, measured):
    """Put a piece on the stack, if it has vertices; return the stack's height."""
    if first == last:
        return waiting
    pieces[waiting, 0], pieces[waiting, 1], pieces[waiting, 2] = first, last, measured
    return waiting + 1


def postpone_hubs(graph, search, order):
    """Put vertices with very many neighbours last; return how many others there are."""
    n = len(order)
    most = max(16.0, 10.0 * math.sqrt(n))
    others, hubs = 0, n
    for v in order.copy():
        if graph.indptr[v + 1] - graph.indptr[v] > most:
            hubs -= 1
            order[hubs] = v
            leave(search, v)
        else:
            order[others] = v
            others += 1
    return others


def leave(search, v):
    """Take a vertex out of every piece."""
    search.region[v] = -1
    for axis in range(AXES):
        search.axes[axis, v] = GONE


def enter(search, piece, region):
    """Mark the vertices of a piece; return the mark."""
    for v in piece:
        search.region[v] = region
    return region


def breadth_first(graph, search, region, start, axis, head):
    """Visit what can be reached from `start` in a region; return the end of the queue.

    The queue begins at `head`, distances go to `axis`, and what is reached moves to region + 1.
    """
    distance, queue, tail = search.axes[axis], search.queue, head + 1
    search.region[start] = region + 1
    distance[start], queue[head] = 0, start
    while head < tail:
        v = queue[head]
        head += 1
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            u = graph.indices[e]
            if search.region[u] == region:
                search.region[u] = region + 1
                distance[u] = distance[v] + 1
                queue[tail] = u
                tail += 1
    return tail


def push_components(graph, search, region, piece, first, pieces, waiting):
    """Put the components of a piece on the stack, small ones together; return its height."""
    begin, end = 0, 0
    for v in piece:
        if search.region[v] == region:
            reached = breadth_first(graph, search, region, v, 0, end)
            if reached - begin > LEAF:
                waiting = push(pieces, waiting, first + begin, first + end, 0)
                begin = end
            end = reached
    for i in range(end):
        piece[i] = search.queue[i]
    return push(pieces, waiting, first + begin, first + end, 0)


def measure(graph, search, region, piece):
    """Give the vertices of a connected piece their coordinates; return the region they are in.

    Two pairs of far vertices, a and b, c and d, give the differences of distances, their sum and
    their difference: on a grid, the directions along its sides and its diagonals.
    """
    axes = search.axes
    for axis in range(AXES):
        start = farthest(graph, axes, piece, axis)
        breadth_first(graph, search, region + axis, start, axis, 0)
    ends = np.full(AXES, GONE)
    for v in piece:
        f = axes[0, v] - axes[1, v]
        g = axes[2, v] - axes[3, v]
        axes[0, v], axes[1, v], axes[2, v], axes[3, v] = f, g, f + g, f - g
        for axis in range(AXES):
            ends[axis] = min(ends[axis], axes[axis, v])
    for v in piece:
        for axis in range(AXES):
            axes[axis, v] -= ends[axis]
    return region + AXES


def farthest(graph, axes, piece, known):
    """Return a vertex far from where earlier searches started, of the least degree among such.

    Gibbs, Poole, Stockmeyer 1976, "An Algorithm for Reducing the Bandwidth and Profile of a Sparse
    Matrix". Axis 0 holds the distances from any vertex at first. The second pair is far from both
    of the first, then from each other.
    """
    best, most, least = piece[0], -1, 0
    for v in piece:
        far = axes[2, v] if known == 3 else axes[0, v]
        if known == 2:
            far = min(far, axes[1, v])
        degree = graph.indptr[v + 1] - graph.indptr[v]
        if far > most or (far == most and degree < least):
            best, most, least = v, far, degree
    return best


def split(graph, search, piece):
    """Reorder a piece into two halves and then their separator; return the halves' sizes.

    They are zero, and the piece as it was, if it has no good separator.
    """
    best_axis, best, least = 0, -1, np.inf
    for axis in range(AXES):
        f = search.axes[axis]
        low, high = sweep(graph, f, search.lowest, piece)
        t, cost = threshold(f, search.lowest, piece, low, high)
        if cost < least:
            best_axis, best, least = axis, t, cost
    if best < 0:
        return 0, 0
    sweep(graph, search.axes[best_axis], search.lowest, piece)
    return divide(search, best_axis, best, piece)


def sweep(graph, f, lowest, piece):
    """Set the least coordinate next to each vertex; return the least and largest of all."""
    least, most = GONE, 0
    for v in piece:
        low = f[v]
        least, most = min(least, low), max(most, low)
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            low = min(low, f[graph.indices[e]])
        lowest[v] = low
    return least, most


def threshold(f, lowest, piece, first, last):
    """Return the t of the best separator and its cost, or -1 if none is good.

    The cost, of the separator over the product of the halves, weighs a short separator against
    equal halves (Leighton and Rao 1999, "Multicommodity Max-Flow Min-Cut Theorems and Their Use in
    Designing Approximation Algorithms").
    """
    below, separator = np.zeros(last - first + 2, np.int64), np.zeros(last - first + 2, np.int64)
    for v in piece:
        below[f[v] + 1 - first] += 1
        separator[lowest[v] + 1 - first] += 1  # v separates for lowest < t <= f
        separator[f[v] + 1 - first] -= 1
    best, least = -1, np.inf
    left, cut = 0, 0
    for t in range(1, last - first + 1):
        left += below[t]
        cut += separator[t]
        right = len(piece) - left - cut
        even = min(left, right) >= LEAST_SHARE * len(piece)
        if even and cut <= LARGEST_SHARE * len(piece) and cut < least * left * right:
            best, least = t + first, cut / (left * right)
    return best, least


def divide(search, axis, t, piece):
    """Reorder a piece by the threshold t; return the sizes of both halves."""
    f, lowest = search.axes[axis], search.lowest
    left, right, separator = 0, 0, len(piece)
    for v in piece:
        if f[v] < t:
            piece[left] = v
            left += 1
        elif lowest[v] >= t:
            search.queue[right] = v
            right += 1
        else:
            separator -= 1
            search.queue[separator] = v
    for i in range(right):
        piece[left + i] = search.queue[i]
    for i in range(separator, len(piece)):
        piece[left + right + i - separator] = search.queue[i]
        leave(search, search.queue[i])
    return left, right
