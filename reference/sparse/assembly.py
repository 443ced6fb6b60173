"""Assembly: the sum of all springs' 3 x 3 blocks as a sparse matrix, its pattern found once."""

import copy
import functools
from typing import Any

import numpy as np
import scipy
from numpy import uint64 as at

from ..arguments import FloatArray, IndexArray, frozen
from ..backend.compiled import Kernel


class BlockSum:
    """Sums of (A_i A_i') x B_i over the springs, for any symmetric 3 x 3 blocks B_i.

    All sums have the same pattern, whose analysis serves for all: every pair of particles that a
    spring joins, and the whole diagonal, even where entries are zero.
    """

    def __init__(self, A: Any) -> None:
        """Prepare for the columns A_i, sparse (particle, spring): 1 and -1, or fewer entries."""
        columns, (n, s) = A.tocsc(), A.shape
        spring = np.repeat(np.arange(s), np.diff(columns.indptr))
        self._ends = np.full((s, 2), -1, dtype=np.int32)
        self._ends[spring, np.arange(columns.nnz) - columns.indptr[spring]] = columns.indices
        self._starts, self._rows = _pattern_of_pairs(self._ends, n)
        self._places = _block_places(self._ends, self._starts, self._rows)
        self._scalar = _pattern(self._starts, self._rows)

    @functools.cached_property
    def _wide(self) -> tuple[Any, IndexArray]:
        starts, rows, diagonal = _widened(self._starts, self._rows)
        return _pattern(starts, rows), diagonal

    @property
    def diagonal(self) -> IndexArray:
        """The places of the diagonal of `matrix` in its data, shape (3 particle,)."""
        return self._wide[1]

    def matrix(self, blocks: FloatArray) -> Any:
        """Return the sum for blocks (spring, 3, 3), sparse CSC (3 particle, 3 particle)."""
        data = _summed_blocks(blocks, self._places, self._ends, self._starts)
        return _filled(self._wide[0], data)

    def scalar_matrix(self, weights: FloatArray, diagonal: FloatArray) -> Any:
        """Return the sum of w_i A_i A_i' and a diagonal, sparse CSC (particle, particle)."""
        data = _summed_weights(weights, diagonal, self._places, self._starts, self._rows)
        return _filled(self._scalar, data)


def _pattern(starts: IndexArray, rows: IndexArray) -> Any:
    """Return a sparse CSC matrix of zeros without memory; its pattern is read-only."""
    size, zeros = len(starts) - 1, np.broadcast_to(0.0, len(rows))
    matrix = scipy.sparse.csc_array((zeros, frozen(rows), frozen(starts)), (size, size))
    matrix.has_canonical_format = True
    return matrix


def _filled(pattern: Any, data: FloatArray) -> Any:
    """Return a matrix that shares a pattern, ten times faster than the constructor."""
    matrix = copy.copy(pattern)
    matrix.data = data
    return matrix


def join_ends(ends, count):
    """Return the pattern of all pairs that a spring joins and of the diagonal, columns sorted."""
    starts = np.zeros(count + 2, np.int64)
    starts[2:] = 1
    for s in range(len(ends)):
        if ends[s, 0] >= 0 and ends[s, 1] >= 0:
            starts[ends[s, 0] + 2] += 1
            starts[ends[s, 1] + 2] += 1
    for c in range(count):
        starts[c + 2] += starts[c + 1]
    next_start, rows = starts.copy(), np.empty(starts[count + 1], np.int32)
    for c in range(count):
        push_row(rows, starts, c, c)
    for s in range(len(ends)):
        if ends[s, 0] >= 0 and ends[s, 1] >= 0:
            push_row(rows, starts, ends[s, 0], ends[s, 1])
            push_row(rows, starts, ends[s, 1], ends[s, 0])
    return without_repeats(starts, sorted_columns(starts, next_start, rows))


def push_row(rows, ends, column, row):
    """Append a row to the column that ends at ends[column + 1]."""
    rows[ends[column + 1]] = row
    ends[column + 1] += 1


def sorted_columns(starts, ends, rows):
    """Return the rows of a symmetric pattern sorted: transposed, column after column."""
    result = np.empty(len(rows), np.int32)
    for c in range(len(starts) - 2):
        for e in range(starts[c], starts[c + 1]):
            push_row(result, ends, rows[e], c)
    return result


def without_repeats(starts, rows):
    """Return starts and rows of sorted columns, each row once."""
    ends, p = np.zeros(len(starts) - 1, np.int32), 0
    for c in range(len(starts) - 2):
        for e in range(starts[c], starts[c + 1]):
            if e == starts[c] or rows[e] != rows[p - 1]:
                rows[p] = rows[e]
                p += 1
        ends[c + 1] = p
    return ends, rows[:p].copy()


def block_places(ends, starts, rows):
    """Return the places of the blocks ii, ji, ij, jj of every spring in sorted columns.

    The place of a block with an end of -1 is -1.
    """
    places = np.full((len(ends), 4), -1, np.int32)
    for s in range(len(ends)):
        for b in range(4):
            column, row = ends[s, b // 2], ends[s, b % 2]
            if column >= 0 and row >= 0:
                places[s, b] = find(rows, starts[column], starts[column + 1], row)
    return places


def find(rows, first, last, row):
    """Return the place of a row among the sorted rows from `first` to `last`."""
    while last - first > 1:
        middle = (first + last) // 2
        if rows[middle] <= row:
            first = middle
        else:
            last = middle
    return first


def widen_pattern(starts, rows):
    """Return the pattern with 3 x 3 entries for each entry, and the places of its diagonal."""
    wide_starts = np.zeros(3 * len(starts) - 2, np.int32)
    wide_rows = np.empty(9 * len(rows), np.int32)
    diagonal, p = np.empty(3 * len(starts) - 3, np.int64), 0
    for column in range(len(starts) - 1):
        for c in range(3):
            for e in range(starts[column], starts[column + 1]):
                for r in range(3):
                    wide_rows[p] = 3 * rows[e] + r
                    if wide_rows[p] == 3 * column + c:
                        diagonal[3 * column + c] = p
                    p += 1
            wide_starts[3 * column + c + 1] = p
    return wide_starts, wide_rows, diagonal


def sum_blocks(blocks, places, ends, starts):
    """Return the data of the sum of (A_i A_i') x B_i in the widened pattern."""
    data = np.zeros(9 * starts[-1])
    for s in range(len(places)):
        for b in range(4):
            place = places[s, b]
            if place >= 0:
                begin, end = starts[ends[s, b // 2]], starts[ends[s, b // 2] + 1]
                first, sign = 6 * begin + 3 * place, 1.0 if b % 3 == 0 else -1.0
                for c in range(3):
                    for r in range(3):
                        data[at(first + 3 * (end - begin) * c + r)] += sign * blocks[s, c, r]
    return data


def sum_weights(weights, diagonal, places, starts, rows):
    """Return the data of the sum of w_i A_i A_i' and a diagonal."""
    data = np.zeros(len(rows))
    for s in range(len(places)):
        for b in range(4):
            if places[s, b] >= 0:
                data[places[s, b]] += weights[s] if b % 3 == 0 else -weights[s]
    for column in range(len(diagonal)):
        data[find(rows, starts[column], starts[column + 1], column)] += diagonal[column]
    return data


_pattern_of_pairs = Kernel(join_ends)
_block_places = Kernel(block_places)
_widened = Kernel(widen_pattern)
_summed_blocks = Kernel(sum_blocks)
_summed_weights = Kernel(sum_weights)
