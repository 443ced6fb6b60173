"""Cholesky factors for callers: analyse, factorise, solve, factorise again."""

import copy
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import FloatArray, floats, shape, shown
from ..backend.compiled import Kernel
from .dissection import Graph
from .multifrontal import SMALLEST, factorize, round_entries, scratch_for
from .symbolic import SymbolicFactor, analyse
from .triangular import REGISTER, RIGHT_HAND_SIDES, solve

LARGEST = float(np.finfo(np.float32).max)
# Entries below SMALLEST are then less than the rounding error of every pivot, and may be left out.
SMALLEST_PIVOT = SMALLEST / float(np.finfo(np.float32).eps)


class NotPositiveDefiniteError(ValueError):
    """The matrix has no Cholesky factor: it is indefinite, singular or not finite."""


class CholeskyFactor:
    """P A P' = L L', L in supernodes."""

    def __init__(self, matrix: Any, pattern: SymbolicFactor | None = None) -> None:
        """Factorise a sparse symmetric matrix, both triangles given.

        `pattern` is the analysis of an earlier matrix, used if the patterns are equal. Raise a
        NotPositiveDefiniteError if a pivot is not positive and finite. Raise another ValueError if
        the matrix is not sparse or square, or its pattern not symmetric.
        """
        columns = square(matrix).tocsc()
        if not columns.has_canonical_format:
            columns = columns.copy()
            columns.sum_duplicates()
        graph = Graph(columns.indptr.astype(np.int32), columns.indices.astype(np.int32))
        if pattern is None or not all(map(np.array_equal, pattern.graph, graph)):
            pattern = analyse(graph)
        self.pattern = pattern
        self._values = np.empty(pattern.updates.entries)
        scratch = scratch_for(pattern.blocks, pattern.updates, len(pattern.order))
        data = np.array(columns.data, dtype=np.float64)
        failed = _factorize(pattern, data, self._values, scratch)
        if failed >= 0:
            raise NotPositiveDefiniteError(
                f"matrix: expected positive definite, got no positive pivot in row"
                f" {pattern.order[failed]}"
            )

    @property
    def entries(self) -> int:
        """The number of stored entries of L."""
        return len(self._values)

    @property
    def multiplications(self) -> float:
        """The multiplications of a factorisation, about the sum of L's columns squared."""
        below = np.diff(self.pattern.blocks.starts).astype(float)
        height = below + np.diff(self.pattern.blocks.columns)
        return float((height**3 - below**3).sum() / 3)

    def refactorize(self, matrix: Any) -> "CholeskyFactor":
        """Return the factor of another matrix, with the same analysis for the same pattern."""
        return CholeskyFactor(matrix, self.pattern)

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b, C-contiguous; `b` has shape (n,) or (n, right-hand side).

        Raise a ValueError if b has another shape or is not numeric.
        """
        n = len(self.pattern.order)
        b = right_sides(b, n)
        if b.shape == (n, RIGHT_HAND_SIDES):
            x = np.empty(b.shape)
            self.solve_into(b, x, np.empty((n, REGISTER)))
            return x
        columns = b.reshape(n, -1)
        x, padded = np.empty(columns.shape), np.zeros((n, RIGHT_HAND_SIDES))
        for first in range(0, columns.shape[1], RIGHT_HAND_SIDES):
            part = slice(first, min(first + RIGHT_HAND_SIDES, columns.shape[1]))
            padded[:, : part.stop - first] = columns[:, part]
            x[:, part] = self.solve(padded)[:, : part.stop - first]
        return x.reshape(b.shape)

    def solve_into(self, b: FloatArray, x: FloatArray, workspace: FloatArray) -> None:
        """Fill x, (n, 3), for unchecked b, (n, 3); the workspace has shape (n, 4)."""
        columns, starts, rows, _ = self.pattern.blocks
        _solve(self.pattern.order, columns, starts, rows, self._values, b, workspace, x)

    def in_single_precision(self) -> "CholeskyFactor":
        """Return the factor with L rounded, or the same factor if L leaves single precision."""
        rounded = copy.copy(self)
        rounded._values = np.empty(self.entries, np.float32)
        largest = _round(self._values, rounded._values)
        in_range = largest <= LARGEST and self._pivots.min(initial=1.0) >= SMALLEST_PIVOT
        return rounded if in_range else self

    @property
    def _pivots(self) -> FloatArray:
        """The diagonal of L, the first entry of each column, shape (n,)."""
        columns, starts, *_ = self.pattern.blocks
        ends = np.repeat(columns[1:] + np.diff(starts), np.diff(columns))
        lengths = ends - np.arange(len(ends))
        return self._values[np.cumsum(lengths) - lengths]


def square(matrix: Any) -> Any:
    """Return a sparse, square, real matrix; raise a ValueError for any other matrix."""
    if not scipy.sparse.issparse(matrix):
        raise ValueError(f"matrix: expected a square sparse matrix, got {shown(matrix)}")
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.dtype.kind not in "fiu":
        got = f"one of {matrix.dtype} of shape {matrix.shape}"
        raise ValueError(f"matrix: expected a square sparse matrix of numbers, got {got}")
    return matrix


def right_sides(b: ArrayLike, n: int) -> FloatArray:
    """Return right-hand sides, (n,) or (n, right-hand side), as floats, or raise a ValueError."""
    columns = floats("b", b, "...")
    if columns.ndim not in (1, 2) or len(columns) != n:
        got = shape(columns.shape)
        raise ValueError(f"b: expected shape ({n},) or ({n}, right-hand side), got {got}")
    return columns


_factorize = Kernel(factorize, relaxed=True, label="sparse Cholesky factors")
_solve = Kernel(solve, relaxed=True, label="sparse triangular solves")
_round = Kernel(round_entries)
