"""Direct solves with one sparse symmetric positive definite matrix and many right-hand sides.

Three ways stand behind one interface: our own `cholesky`, the default, CHOLMOD through cholespy
where that is installed, and SciPy's SuperLU. cholespy prints a warning at an indefinite matrix.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .arguments import FloatArray, choice, floats, shape, shown
from .cholesky import CholeskyFactor, NotPositiveDefiniteError


class Factor(Protocol):
    """A factorised matrix A."""

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b, C-contiguous; `b` has shape (n,) or (n, right-hand side)."""

    def refactorize(self, matrix: Any) -> "Factor":
        """Return the factor of another matrix, quicker where its pattern is the same.

        Raises:
            NotPositiveDefiniteError: if the matrix is not positive definite.
        """


def factorize(matrix: Any, library: str = "supernodal") -> Factor:
    """Return the factor of a sparse symmetric positive definite matrix, both triangles given.

    `library` is "supernodal", "cholespy" or "scipy".

    Raises:
        NotPositiveDefiniteError: if the matrix is not positive definite.
        ValueError: if the library is unknown, or the matrix not sparse, real and square.
    """
    factor = LIBRARIES[choice("library", library, LIBRARIES)]
    matrix = checked_matrix(matrix)
    if not np.isfinite(matrix.data).all():
        raise NotPositiveDefiniteError("matrix: expected finite entries, got NaN or infinity")
    return factor(matrix)


def checked_matrix(matrix: Any) -> Any:
    """Return the argument if it is a sparse, real and square matrix.

    Raises:
        ValueError: if it is anything else.
    """
    square = scipy.sparse.issparse(matrix) and matrix.ndim == 2 and len({*matrix.shape}) == 1
    if not square or matrix.dtype.kind not in "fiu":
        raise ValueError(f"matrix: expected a sparse, real, square one, got {shown(matrix)}")
    return matrix


def checked_sides(b: ArrayLike, n: int) -> FloatArray:
    """Return right-hand sides, (n,) or (n, right-hand side), whatever numbers they hold.

    Raises:
        ValueError: if they are no numbers or have another shape.
    """
    given = floats("b", b, "...")
    if given.ndim not in (1, 2) or len(given) != n:
        raise ValueError(f"b: expected shape ({n},) or ({n}, side), got {shape(given.shape)}")
    return given


class SuperLUFactor:
    """P A P' = L U by SuperLU, pivots on the diagonal: all positive only if A is definite."""

    def __init__(self, matrix: Any):
        try:
            self._lu = scipy.sparse.linalg.splu(
                checked_matrix(matrix).tocsc(),
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
        """How many entries of L are stored."""
        return self._lu.L.nnz

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b."""
        return np.ascontiguousarray(self._lu.solve(checked_sides(b, self._lu.shape[0])))

    def refactorize(self, matrix: Any) -> Factor:
        """Return the factor of another matrix."""
        return factorize(matrix, "scipy")


class CholespyFactor:
    """P A P' = L L' by CHOLMOD through cholespy."""

    def __init__(self, matrix: Any):
        import cholespy

        entries = checked_matrix(matrix).astype(np.float64).tocoo()
        self._size = matrix.shape[0]
        rows, columns = entries.row.astype(np.int32), entries.col.astype(np.int32)
        layout = cholespy.MatrixType.COO
        try:
            self._solver = cholespy.CholeskySolverD(
                matrix.shape[0], rows, columns, entries.data, layout
            )
        except ValueError:
            raise NotPositiveDefiniteError("matrix: expected positive definite") from None

    def solve(self, b: FloatArray) -> FloatArray:
        """Return x of A x = b."""
        b = checked_sides(b, self._size)
        x = np.empty_like(b, order="C")
        self._solver.solve(b, x)
        return x

    def refactorize(self, matrix: Any) -> Factor:
        """Return the factor of another matrix."""
        return factorize(matrix, "cholespy")


LIBRARIES: dict[str, Callable[[Any], Factor]] = {
    "supernodal": CholeskyFactor,
    "cholespy": CholespyFactor,
    "scipy": SuperLUFactor,
}
