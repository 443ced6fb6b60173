"""Nested dissection: an order of elimination that leaves little fill, from the graph only.

A separator is eliminated after the two halves on its sides, and so on inside of the halves (George
1973, "Nested Dissection of a Regular Finite Element Mesh"). Here separators are level sets of a few
coordinates, from breadth-first searches. With a and b far apart, dist(v, a) - dist(v, b) grows
evenly from a to b. Its level sets are straight, while level sets of a distance bend. For any
threshold t of a coordinate f, the vertices with f >= t and a neighbour with f < t are a separator.
A single sweep over the edges counts the vertices for every t.

Pieces without a good split are ordered from the inside out. The neighbours of a piece are
eliminated later, so vertices on its rim, with many such neighbours, go last.
"""

import math
from typing import NamedTuple

import numpy as np

from ..backend.compiled import Kernel

LEAF = 4  # pieces of at most so many vertices are not split
LEAST_SHARE = 0.2  # of a piece: what the smaller half must have
LARGEST_SHARE = 0.3  # of a piece: what a good separator may have
AXES = 4  # coordinates of a vertex
REMOVED = 2**30  # the coordinates of a vertex in a separator


class Graph(NamedTuple):
    """The neighbours of vertex v are indices[indptr[v]:indptr[v + 1]]; v itself may be included."""

    indptr: np.ndarray
    indices: np.ndarray


class Search(NamedTuple):
    """The results of the searches, which the splits read."""

    region: np.ndarray  # the piece of each vertex; a search adds one for the vertices it reaches
    axes: np.ndarray  # the coordinates, shape (axis, vertex)
    queue: np.ndarray  # the vertices in the order reached
    lowest: np.ndarray  # the least coordinate among a vertex and its neighbours


def nested_dissection(graph: Graph) -> np.ndarray:
    """Return an order of the vertices with little fill; very many neighbours put a vertex last."""
    n = len(graph.indptr) - 1
    is_hub = np.diff(graph.indptr) > max(16.0, 10.0 * math.sqrt(n))
    order = np.argsort(is_hub, kind="stable").astype(np.int32)
    _dissect(graph, order, n - int(is_hub.sum()))
    return order


def dissect(graph, order, count):
    """Reorder the first vertices of an order in place; the other vertices are in no piece."""
    n = len(order)
    inside = np.zeros(n, np.bool_)
    search = Search(
        np.zeros(n, np.int32),
        np.zeros((AXES, n), np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
    )
    for v in order[count:]:
        leave(search, v)
    pieces = np.empty((n + 2, 3), np.int32)  # first, last + 1 in order; whether it has coordinates
    waiting = push(pieces, 0, 0, count, 0)
    region = 0
    while waiting > 0:
        waiting -= 1
        first, last, measured = pieces[waiting, 0], pieces[waiting, 1], pieces[waiting, 2]
        piece = order[first:last]
        if len(piece) <= LEAF:
            put_rim_last(graph, piece, inside)
            continue
        if not measured:
            region += 1
            search.region[piece] = region
            if breadth_first(graph, search, region, piece[0], 0, 0) < len(piece):
                region += 2
                search.region[piece] = region
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
        else:
            put_rim_last(graph, piece, inside)


def push(pieces, waiting, first, last, measured):
    """Push a piece, unless it is empty; return the stack's height."""
    if first == last:
        return waiting
    pieces[waiting, 0], pieces[waiting, 1], pieces[waiting, 2] = first, last, measured
    return waiting + 1


def leave(search, v):
    """Remove a vertex from every piece."""
    search.region[v] = -1
    for axis in range(AXES):
        search.axes[axis, v] = REMOVED


def breadth_first(graph, search, region, start, axis, head):
    """Visit the vertices connected with `start` in a region; return the end of the queue.

    The queue begins at `head`, distances go to `axis`, and visited vertices to region + 1.
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
    """Push the components of a piece, small components together; return the stack's height."""
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
    """Fill four coordinates of each vertex of a connected piece; return the piece's region.

    For two pairs of far vertices, a and b, c and d, f is the distance from a less the distance from
    b, and g the same for c and d. The coordinates are f, g, f + g and f - g. On a grid they run
    along its sides and its diagonals.
    """
    axes = search.axes
    for axis in range(AXES):
        start = farthest(graph, axes, piece, axis)
        breadth_first(graph, search, region + axis, start, axis, 0)
    ends = np.full(AXES, REMOVED)
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


def farthest(graph, axes, piece, axis):
    """Return the vertex of least degree among the farthest from the starts of earlier searches.

    Gibbs, Poole, Stockmeyer 1976, "An Algorithm for Reducing the Bandwidth and Profile of a Sparse
    Matrix". Axis 0 holds the distances from any vertex at first. The second pair is far from both
    of the first, then from each other.
    """
    best, largest, lowest_degree = piece[0], -1, 0
    for v in piece:
        distance = axes[2, v] if axis == 3 else axes[0, v]
        if axis == 2:
            distance = min(distance, axes[1, v])
        degree = graph.indptr[v + 1] - graph.indptr[v]
        if distance > largest or (distance == largest and degree < lowest_degree):
            best, largest, lowest_degree = v, distance, degree
    return best


def split(graph, search, piece):
    """Reorder a piece into two halves and then their separator; return the halves' sizes.

    Without a good separator the sizes are zero, and the piece is left as it was.
    """
    best_axis, best, lowest_cost = 0, -1, np.inf
    for axis in range(AXES):
        f = search.axes[axis]
        low, high = sweep(graph, f, search.lowest, piece)
        t, cost = threshold(f, search.lowest, piece, low, high)
        if cost < lowest_cost:
            best_axis, best, lowest_cost = axis, t, cost
    if best < 0:
        return 0, 0
    sweep(graph, search.axes[best_axis], search.lowest, piece)
    return divide(search, best_axis, best, piece)


def sweep(graph, f, lowest, piece):
    """Set the least coordinate next to each vertex; return the least and largest of all."""
    first, last = REMOVED, 0
    for v in piece:
        low = f[v]
        first, last = min(first, low), max(last, low)
        for e in range(graph.indptr[v], graph.indptr[v + 1]):
            low = min(low, f[graph.indices[e]])
        lowest[v] = low
    return first, last


def threshold(f, lowest, piece, first, last):
    """Return the t of the best separator and its cost, or -1 if none is good.

    The cost, the separator over the product of the halves, weighs a short separator against equal
    halves (Leighton and Rao 1999, "Multicommodity Max-Flow Min-Cut Theorems and Their Use in
    Designing Approximation Algorithms").
    """
    below, separator = np.zeros(last - first + 2, np.int64), np.zeros(last - first + 2, np.int64)
    for v in piece:
        below[f[v] + 1 - first] += 1
        separator[lowest[v] + 1 - first] += 1  # v separates for lowest < t <= f
        separator[f[v] + 1 - first] -= 1
    best, lowest_cost = -1, np.inf
    left, size = 0, 0
    for t in range(1, last - first + 1):
        left += below[t]
        size += separator[t]
        right = len(piece) - left - size
        even = min(left, right) >= LEAST_SHARE * len(piece)
        if even and size <= LARGEST_SHARE * len(piece) and size < lowest_cost * left * right:
            best, lowest_cost = t + first, size / (left * right)
    return best, lowest_cost


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


def put_rim_last(graph, piece, inside):
    """Reorder a piece by the number of neighbours outside; `inside` is False before and after."""
    outside = np.zeros(len(piece), np.int32)
    inside[piece] = True
    for i in range(len(piece)):
        for e in range(graph.indptr[piece[i]], graph.indptr[piece[i] + 1]):
            outside[i] += not inside[graph.indices[e]]
    inside[piece] = False
    places = np.zeros(outside.max() + 2, np.int32)
    for count in outside:
        places[count + 1] += 1
    places = np.cumsum(places)
    for i, v in enumerate(piece.copy()):
        piece[places[outside[i]]] = v
        places[outside[i]] += 1


_dissect = Kernel(dissect, label="the analysis of sparse matrices")
