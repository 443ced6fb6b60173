"""Cholesky factors for callers: analyse, factorise, solve, factorise again."""

from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ..arguments import FLOAT64, FloatArray, floats, instance, shape, shown
from ..backend.compiled import Kernel
from .dissection import Graph
from .multifrontal import factorize
from .symbolic import analyse
from .triangular import REGISTER, RIGHT_HAND_SIDES, solve


class NotPositiveDefiniteError(ValueError):
    """The matrix has no Cholesky factor: it is indefinite, singular or not finite."""


class SymbolicFactor:
    """The analysis of a symmetric pattern, shared by the factors of all matrices of the pattern."""

    def __init__(self, indptr: Any, indices: Any) -> None:
        """Order the columns and find L's pattern; a ValueError if A's is not symmetric."""
        n = len(indptr) - 1
        pattern = scipy.sparse.csc_array((np.ones(len(indices), np.int8), indices, indptr), (n, n))
        if (pattern != pattern.T).nnz:
            raise ValueError("matrix: expected both triangles with the same pattern")
        self.graph = Graph(indptr, indices)
        self.order, self.place, self.blocks, self.family = _analyse(
            self.graph, np.arange(n, dtype=np.int32)
        )

    def fits(self, indptr: Any, indices: Any) -> bool:
        """Return whether the pattern is the same."""
        return all(map(np.array_equal, self.graph, (indptr, indices)))


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
        indptr, indices = columns.indptr.astype(np.int32), columns.indices.astype(np.int32)
        if pattern is None or not instance("pattern", pattern, SymbolicFactor).fits(
            indptr, indices
        ):
            pattern = SymbolicFactor(indptr, indices)
        self.pattern = pattern
        self._values = np.empty(pattern.family.entries)
        self._spare: list[FloatArray] = []  # workspaces for the unknowns, one a thread
        data = np.array(columns.data, dtype=np.float64)
        failed = _factorize(
            pattern.graph, data, pattern.order, pattern.place, pattern.blocks, pattern.family,
            self._values,
        )  # fmt: skip
        if failed >= 0:
            raise NotPositiveDefiniteError(
                f"matrix: expected positive definite, got no positive pivot in row"
                f" {pattern.order[failed]}"
            )

    @property
    def entries(self) -> int:
        """The number of stored entries of L."""
        return len(self._values)

    def refactorize(self, matrix: Any) -> "CholeskyFactor":
        """Return the factor of another matrix, with the same analysis for the same pattern."""
        return CholeskyFactor(matrix, self.pattern)

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b, C-contiguous; `b` has shape (n,) or (n, right-hand side).

        Raise a ValueError if b has another shape or is not numeric.
        """
        n, pattern = len(self.pattern.order), self.pattern
        if type(b) is not np.ndarray or b.dtype != FLOAT64 or not b.flags.carray:
            b = floats("b", b, "...")
        if b.shape == (n, RIGHT_HAND_SIDES):
            x = np.empty(b.shape)
            columns, starts, rows, _ = pattern.blocks
            try:
                y = self._spare.pop()
            except IndexError:  # none yet, or all are used by other threads
                y = np.empty((n, REGISTER))
            _solve(pattern.order, columns, starts, rows, self._values, b, y, x)
            self._spare.append(y)
            return x
        columns = right_sides(b, n).reshape(n, -1)
        x, padded = np.empty(columns.shape), np.zeros((n, RIGHT_HAND_SIDES))
        for first in range(0, columns.shape[1], RIGHT_HAND_SIDES):
            part = slice(first, min(first + RIGHT_HAND_SIDES, columns.shape[1]))
            padded[:, : part.stop - first] = columns[:, part]
            x[:, part] = self.solve(padded)[:, : part.stop - first]
        return x.reshape(b.shape)

    def lower(self) -> Any:
        """Return L, sparse (n, n), with the explicit zeros of its blocks."""
        columns, starts, rows, _ = self.pattern.blocks
        lists = []
        for s in range(len(columns) - 1):
            block = np.r_[columns[s] : columns[s + 1], rows[starts[s] : starts[s + 1]]]
            lists += [block[column:] for column in range(columns[s + 1] - columns[s])]
        indptr = np.cumsum([0, *map(len, lists)])
        return scipy.sparse.csc_array((self._values, np.concatenate(lists), indptr))


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


_analyse = Kernel(analyse, label="the analysis of sparse matrices")
_factorize = Kernel(factorize, relaxed=True, label="sparse Cholesky factors")
_solve = Kernel(solve, relaxed=True, label="sparse triangular solves")
