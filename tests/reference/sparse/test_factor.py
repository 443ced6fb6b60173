"""Laws of direct solves, and of the errors for other matrices and right-hand sides."""

import numpy as np
import pytest
import scipy.sparse

from plumbob.reference.sparse import CholeskyFactor, NotPositiveDefiniteError


@pytest.fixture
def matrix(rng):
    """A random sparse symmetric matrix of 30 rows, eigenvalues from 1 up."""
    B = scipy.sparse.random_array((30, 30), density=0.1, rng=rng)
    return (B @ B.T + scipy.sparse.eye_array(30)).tocsc()


@pytest.mark.parametrize("sides", [(), (1,), (3,)])
def test_the_solution_solves(matrix, rng, sides):
    x = rng.standard_normal((30, *sides))
    solved = CholeskyFactor(matrix).solve(matrix @ x)
    # The condition number is below 100: two digits of sixteen, and a few roundings more.
    np.testing.assert_allclose(solved, x, rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    "dense",
    [
        np.diag([1.0, -1.0, 2.0]),
        np.array([[1.0, 2.0], [2.0, 1.0]]),
        np.array([[1.0, 1.0], [1.0, 1.0]]),
        np.array([[0.0, 1.0], [1.0, 0.0]]),
        np.diag([1.0, np.nan]),
        np.diag([1.0, np.inf]),
    ],
    ids=["negative", "saddle", "singular", "no diagonal", "NaN", "infinity"],
)
def test_what_is_not_positive_definite_is_refused(dense):
    with pytest.raises(NotPositiveDefiniteError, match=r"^matrix: "):
        CholeskyFactor(scipy.sparse.csc_array(dense))


def test_another_matrix_is_refactorised_whatever_its_pattern(matrix, rng):
    factor = CholeskyFactor(matrix)
    x = rng.standard_normal((30, 3))
    for other in (2 * matrix, matrix @ matrix):
        solved = factor.refactorize(other.tocsc()).solve(other @ x)
        # Squaring squares the condition number, which stays below 10,000.
        np.testing.assert_allclose(solved, x, rtol=0, atol=1e-11)


@pytest.mark.parametrize("shape", [(29,), (31,), (29, 3), (60,), (3, 30), (90,), (30, 3, 1), ()])
def test_a_right_hand_side_of_another_size_is_named(matrix, shape):
    with pytest.raises(ValueError, match=r"^b: expected shape \(30,\) or \(30, right-hand side\)"):
        CholeskyFactor(matrix).solve(np.ones(shape))


def test_a_matrix_that_is_not_square_or_not_sparse_is_named():
    for wrong in (np.eye(3), scipy.sparse.csc_array(np.ones((3, 2))), None):
        with pytest.raises(ValueError, match=r"^matrix: expected a square sparse matrix"):
            CholeskyFactor(wrong)


def test_one_triangle_is_no_symmetric_pattern(matrix):
    with pytest.raises(ValueError, match=r"^matrix: expected both triangles"):
        CholeskyFactor(scipy.sparse.tril(matrix, format="csc"))
