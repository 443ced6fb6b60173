"""Direct solves with a sparse symmetric positive definite matrix and many right-hand sides.

Two solvers have the same interface: our own `CholeskyFactor`, the default, and SciPy's SuperLU.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import scipy

from ..arguments import FloatArray, choice
from . import CholeskyFactor, NotPositiveDefiniteError
from .factor import right_sides, square


class Factor(Protocol):
    """A factorised matrix A."""

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b, C-contiguous; `b` has shape (n,) or (n, right-hand side)."""

    def refactorize(self, matrix: Any) -> "Factor":
        """Return the factor of another matrix, faster where its pattern is the same."""


def factorize(matrix: Any, library: str = "supernodal") -> Factor:
    """Return the factor of a sparse symmetric positive definite matrix, both triangles given.

    `library` is "supernodal" or "scipy". Raise a NotPositiveDefiniteError if the matrix is not
    positive definite, another ValueError if the matrix is not sparse, real and square.
    """
    factor = LIBRARIES[choice("library", library, LIBRARIES)]
    if not np.isfinite(square(matrix).data).all():
        raise NotPositiveDefiniteError("matrix: expected finite entries, got NaN or infinity")
    return factor(matrix)


class SuperLUFactor:
    """P A P' = L U by SuperLU, pivots on the diagonal: all positive only if A is definite."""

    def __init__(self, matrix: Any):
        try:
            self._lu = scipy.sparse.linalg.splu(
                square(matrix).tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:  # an exact zero pivot
            raise NotPositiveDefiniteError("matrix: singular, expected positive definite") from None
        on_diagonal = np.array_equal(self._lu.perm_r, self._lu.perm_c)
        if not (on_diagonal and self._lu.U.diagonal().min() > 0):
            raise NotPositiveDefiniteError("matrix: indefinite, expected positive definite")

    @property
    def entries(self) -> int:
        """The number of stored entries of L."""
        return self._lu.L.nnz

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b."""
        return np.ascontiguousarray(self._lu.solve(right_sides(b, self._lu.shape[0])))

    def refactorize(self, matrix: Any) -> Factor:
        """Return the factor of another matrix."""
        return factorize(matrix, "scipy")


LIBRARIES: dict[str, Callable[[Any], Factor]] = {
    "supernodal": CholeskyFactor,
    "scipy": SuperLUFactor,
}
