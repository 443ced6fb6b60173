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

    All sums share a pattern, which is analysed once: every pair of particles joined by a spring,
    and the whole diagonal, even where entries are zero.
    """

    def __init__(self, A: Any) -> None:
        """Prepare for the columns A_i, sparse (particle, spring): 1 and -1, or fewer entries."""
        columns, (n, s) = A.tocsc(), A.shape
        spring = np.repeat(np.arange(s), np.diff(columns.indptr))
        self._ends = np.full((s, 2), -1, dtype=np.int32)
        self._ends[spring, np.arange(columns.nnz) - columns.indptr[spring]] = columns.indices
        self._scalar = _pattern(_adjacency(self._ends, n))
        self._starts, self._rows = self._scalar.indptr, self._scalar.indices
        self._places = _block_places(self._ends, self._starts, self._rows)

    @functools.cached_property
    def _wide(self) -> tuple[Any, IndexArray]:
        blocks = np.broadcast_to(np.int8(1), (len(self._rows), 3, 3))
        wide = _pattern(scipy.sparse.bsr_array((blocks, self._rows, self._starts)).tocsr())
        columns = np.repeat(np.arange(wide.shape[1], dtype=np.int32), np.diff(wide.indptr))
        return wide, np.flatnonzero(wide.indices == columns)

    @property
    def places(self) -> tuple[IndexArray, IndexArray, IndexArray]:
        """The arguments of `add_blocks` between blocks and data."""
        return self._places, self._ends, self._starts

    @property
    def diagonal(self) -> IndexArray:
        """The places of the diagonal of `matrix` in its data, shape (3 particle,)."""
        return self._wide[1]

    def matrix(self, blocks: FloatArray) -> Any:
        """Return the sum for blocks (spring, 3, 3), sparse CSC (3 particle, 3 particle)."""
        data = np.zeros(9 * len(self._rows))
        _add_blocks(blocks, *self.places, data)
        return _filled(self._wide[0], data)

    def scalar_matrix(self, weights: FloatArray, diagonal: FloatArray) -> Any:
        """Return the sum of w_i A_i A_i' and a diagonal, sparse CSC (particle, particle)."""
        data = _summed_weights(weights, diagonal, self._places, self._starts, self._rows)
        return _filled(self._scalar, data)


def _adjacency(ends: IndexArray, count: int) -> Any:
    """Return all pairs of particles joined by springs and the diagonal as entries, sparse CSC."""
    i, j = ends[(ends >= 0).all(axis=1)].T
    diagonal = np.arange(count, dtype=np.int32)
    rows, columns = np.concatenate([i, j, diagonal]), np.concatenate([j, i, diagonal])
    blocks = np.ones(len(rows), np.int8)
    pairs = scipy.sparse.coo_array((blocks, (rows, columns)), (count, count)).tocsc()
    pairs.sort_indices()
    return pairs


def _pattern(symmetric: Any) -> Any:
    """Return a sparse CSC matrix of zeros without memory; its pattern is read-only."""
    rows, starts = frozen(symmetric.indices), frozen(symmetric.indptr)
    zeros = np.broadcast_to(0.0, len(rows))
    matrix = scipy.sparse.csc_array((zeros, rows, starts), symmetric.shape)
    matrix.has_canonical_format = True
    return matrix


def _filled(pattern: Any, data: FloatArray) -> Any:
    """Return a matrix on a shared pattern, ten times faster than the constructor."""
    matrix = copy.copy(pattern)
    matrix.data = data
    return matrix


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


def add_blocks(blocks, places, ends, starts, data):
    """Add the sum of (A_i A_i') x B_i to data in the widened pattern."""
    for s in range(len(places)):
        for b in range(4):
            place = places[s, b]
            if place >= 0:
                begin, end = starts[ends[s, b // 2]], starts[ends[s, b // 2] + 1]
                first, sign = 6 * begin + 3 * place, 1.0 if b % 3 == 0 else -1.0
                for c in range(3):
                    for r in range(3):
                        data[at(first + 3 * (end - begin) * c + r)] += sign * blocks[s, c, r]


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


_block_places = Kernel(block_places)
_add_blocks = Kernel(add_blocks)
_summed_weights = Kernel(sum_weights)
