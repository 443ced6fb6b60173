"""Laws of the sparse Cholesky factor and of each step towards it."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from plumbob.reference import scenes
from plumbob.reference.backend import compiled
from plumbob.reference.implicit_euler.objective import global_matrix
from plumbob.reference.sparse import CholeskyFactor, NotPositiveDefiniteError
from plumbob.reference.sparse.multifrontal import PANEL, STRIP, eliminate
from plumbob.reference.sparse.triangular import AHEAD

pytestmark = pytest.mark.both_backends

EPS = np.finfo(float).eps


def definite(pattern, seed=0):
    """Return a matrix with the given pattern of neighbours, diagonally dominant by a little."""
    entries = scipy.sparse.triu(scipy.sparse.coo_array(pattern), 1)
    values = np.random.default_rng(seed).uniform(-1, 1, entries.nnz)
    upper = scipy.sparse.coo_array((values, (entries.row, entries.col)), pattern.shape).tocsc()
    both = upper + upper.T
    return (both + scipy.sparse.diags_array(abs(both).sum(axis=0) + 0.1)).tocsc()


def grid(rows, columns):
    """Return the pattern of a cloth without its diagonals: the next and next but one neighbours."""
    places = np.arange(rows * columns).reshape(rows, columns)
    pairs = [
        (places[: rows - step], places[step:]) if along else (places[:, :-step], places[:, step:])
        for step in (1, 2)
        for along in (True, False)
    ]
    i, j = (np.concatenate([side.ravel() for side in sides]) for sides in zip(*pairs, strict=True))
    return scipy.sparse.coo_array((np.ones(len(i)), (i, j)), (rows * columns,) * 2)


def arrow(n):
    """Return the pattern of a star, its hub first: eliminated first, it would fill everything."""
    rows = np.zeros(n - 1, int)
    return scipy.sparse.coo_array((np.ones(n - 1), (rows, np.arange(1, n))), (n, n))


def scattered(n, edges, seed):
    """Return a random pattern; with few edges, one in many parts."""
    i, j = np.random.default_rng(seed).integers(0, n, (2, edges))
    return scipy.sparse.coo_array((np.ones(edges), (np.minimum(i, j), np.maximum(i, j))), (n, n))


PATTERNS = {
    "one": scattered(1, 0, 0),
    "diagonal": scattered(60, 0, 0),
    "pair": arrow(2),
    "star": arrow(400),
    "path": scipy.sparse.coo_array(scipy.sparse.eye_array(140, k=1)),
    "parts": scipy.sparse.coo_array(scipy.sparse.block_diag([grid(4, 30), grid(1, 3), grid(9, 9)])),
    "clique": scipy.sparse.coo_array(np.ones((40, 40))),
    "random": scattered(150, 220, 1),
    "cloth": grid(13, 17),
}
LARGER = {
    "cloth": grid(60, 41),
    "strip": grid(700, 3),
    "many parts": scattered(3000, 1900, 2),
    "expander": scattered(1500, 4500, 3),
    "large expander": scattered(2100, 3000, 4),
}


@pytest.fixture(params=PATTERNS)
def matrix(request):
    return definite(PATTERNS[request.param])


@pytest.fixture(params=LARGER)
def larger(request):
    return definite(LARGER[request.param])


def filled(dense):
    """Return the pattern of L of a dense matrix by eliminating column after column."""
    pattern = dense != 0
    for j in range(len(pattern)):
        below = np.flatnonzero(pattern[j + 1 :, j]) + j + 1
        pattern[np.ix_(below, below)] = True
    return np.tril(pattern)


def lower(factor):
    """Return L, sparse (n, n), with the explicit zeros of its blocks."""
    columns, starts, rows, _ = factor.pattern.blocks
    lists = []
    for s in range(len(columns) - 1):
        block = np.r_[columns[s] : columns[s + 1], rows[starts[s] : starts[s + 1]]]
        lists += [block[column:] for column in range(columns[s + 1] - columns[s])]
    indptr = np.cumsum([0, *map(len, lists)])
    return scipy.sparse.csc_array((factor._values, np.concatenate(lists), indptr))


def rounding(matrix):
    """Return how far n roundings can move L L' or A x: a bound far above what they do."""
    return 2 * matrix.shape[0] * EPS * abs(matrix).max()


def check_factor(matrix):
    factor = CholeskyFactor(matrix)
    order, L = factor.pattern.order, lower(factor)
    np.testing.assert_array_equal(np.sort(order), np.arange(matrix.shape[0]))
    product = (L @ L.T).toarray()
    permuted = matrix.toarray()[np.ix_(order, order)]
    np.testing.assert_allclose(product, permuted, rtol=0, atol=rounding(matrix))


def test_the_factor_times_its_transpose_is_the_permuted_matrix(backend, matrix):
    check_factor(matrix)


def test_the_solution_solves_where_graphs_are_split_again_and_again(larger, rng):
    factor = CholeskyFactor(larger)
    np.testing.assert_array_equal(np.sort(factor.pattern.order), np.arange(larger.shape[0]))
    b = rng.standard_normal((larger.shape[0], 3))
    # Dominance keeps |A| |x| within a few hundred times |b|, of which eps is left.
    np.testing.assert_allclose(larger @ factor.solve(b), b, rtol=0, atol=1e-11)


def test_the_stored_pattern_is_that_of_elimination_and_a_few_zeros(backend, matrix):
    # A row missing from a block would lose an entry; a block that is merged too often wastes time.
    factor = CholeskyFactor(matrix)
    order = factor.pattern.order
    needed = filled(matrix.toarray()[np.ix_(order, order)])
    stored = lower(factor)
    stored.data[:] = 1.0
    stored = stored.toarray() != 0
    assert (stored | ~needed).all()
    assert np.count_nonzero(stored) == factor.entries
    assert factor.entries <= needed.sum() / 0.5


def test_a_factor_longer_than_what_is_prefetched_solves_as_well(rng):
    n = 150
    A, x = definite(np.ones((n, n))), rng.standard_normal((n, 3))
    factor = CholeskyFactor(A)
    assert factor.entries > AHEAD
    # Dominance by 0.1 over sums of less than 150: a condition number of some thousands.
    np.testing.assert_allclose(factor.solve(A @ x), x, rtol=0, atol=1e4 * EPS)


def test_a_factor_in_single_precision_solves_to_its_rounding(backend, matrix, rng):
    x = rng.standard_normal((matrix.shape[0], 3))
    exact = CholeskyFactor(matrix)
    rounded = exact.in_single_precision()
    assert (exact._values.itemsize, rounded._values.itemsize) == (8, 4)
    solution = rounded.solve(matrix @ x)
    # Dominance keeps the condition number below 1000.
    np.testing.assert_allclose(solution, x, rtol=0, atol=1000 * np.finfo(np.float32).eps)
    assert matrix.shape[0] < 5 or np.abs(solution - x).max() > EPS


@pytest.mark.parametrize(
    ("diagonal", "coupling", "in_range"),
    [
        ([1.0, 1.0, 1.0], 1e-43, True),
        ([1e75, 1.0, 1e-60], 1e-40, True),
        ([1e78, 1.0, 1.0], 0.5, False),
        ([1.0, 1e-64, 1.0], 0.0, False),
        ([1e-75, 1e-75, 1e-75], 0.0, False),
    ],
)
def test_a_factor_beyond_single_precision_is_left_as_it_is(backend, diagonal, coupling, in_range):
    """Small entries off the diagonal may vanish; a pivot that did would divide by zero."""
    matrix = np.diag(diagonal)
    matrix[0, 1] = matrix[1, 0] = coupling
    matrix = scipy.sparse.csc_array(matrix)
    exact = CholeskyFactor(matrix)
    rounded = exact.in_single_precision()
    assert (rounded is not exact) == in_range
    x = np.arange(1.0, 10.0).reshape(3, 3)
    np.testing.assert_allclose(rounded.solve(matrix @ x), x, rtol=1e-6, atol=0)
    sizes = np.abs(rounded._values[rounded._values != 0])
    assert sizes.min() >= np.finfo(rounded._values.dtype).tiny


@pytest.mark.parametrize("sides", [(), (1,), (2,), (3,), (4,), (6,), (7,)])
def test_any_number_of_right_hand_sides_gives_what_each_gives_by_itself(rng, sides):
    matrix = definite(PATTERNS["cloth"])
    factor = CholeskyFactor(matrix)
    b = rng.standard_normal((matrix.shape[0], *sides))
    x = factor.solve(b)
    assert x.shape == b.shape
    expected = scipy.sparse.linalg.spsolve(matrix, b)
    # Dominance keeps the condition number below 200.
    np.testing.assert_allclose(x, expected.reshape(b.shape), rtol=0, atol=1e-12)


def test_nothing_is_computed_from_memory_that_was_never_written(matrix, monkeypatch):
    """Fresh memory holds signalling NaNs: arithmetic on one is an invalid operation."""
    signal = np.uint64(0x7FF0000000000001)

    def unwritten(count, dtype=float):
        return np.full(count, signal).view(float) if dtype is float else np.empty(count, dtype)

    fresh = SimpleNamespace(empty=unwritten, int32=np.int32)
    monkeypatch.setattr("plumbob.reference.sparse.multifrontal.np", fresh)
    with compiled.set_backend("python"), np.errstate(all="raise"):
        factor = CholeskyFactor(matrix)
    assert np.isfinite(factor._values).all()


@pytest.mark.parametrize("size", [40, 60, 80])
def test_a_cloths_factor_is_as_sparse_as_minimum_degree_makes_it(size):
    # Separators that bend, or halves that are cut crooked, cost a quarter and more.
    matrix = global_matrix(scenes.lab_cloth(size=size)[0], 1 / 60)
    theirs = scipy.sparse.linalg.splu(
        matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    assert CholeskyFactor(matrix).entries < 1.1 * theirs.L.nnz


def test_an_indefinite_matrix_is_refused_wherever_it_is(backend, matrix):
    for row in {0, matrix.shape[0] // 2, matrix.shape[0] - 1}:
        spoiled = matrix.tolil()
        spoiled[row, row] = -spoiled[row, row]
        with pytest.raises(NotPositiveDefiniteError, match=r"^matrix: expected positive definite"):
            CholeskyFactor(spoiled.tocsc())


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("diagonal", [True, False])
def test_what_is_not_finite_is_refused(backend, value, diagonal):
    matrix = definite(PATTERNS["pair"]).tolil()
    matrix[1, 0] = matrix[0, 1] = value
    if diagonal:
        matrix[0, 0], matrix[1, 0], matrix[0, 1] = value, 0.1, 0.1
    with pytest.raises(NotPositiveDefiniteError):
        CholeskyFactor(matrix.tocsc())


@pytest.mark.parametrize(
    ("size", "width"),
    [(1, 1), (7, 3), (9, 9), (PANEL + 5, PANEL + 2), (PANEL + 70, PANEL), (STRIP + 90, PANEL + 40)],
)
def test_a_dense_front_is_eliminated_as_a_library_does(rng, size, width):
    B = rng.standard_normal((size, size))
    A = B @ B.T + size * np.eye(size)
    front = A.copy()
    assert _eliminate(front, width) == -1
    L = np.linalg.cholesky(A)[:, :width]
    np.testing.assert_allclose(np.triu(front)[:width], L.T, rtol=0, atol=1e-12 * size)
    left = np.triu((A - L @ L.T)[width:, width:])
    np.testing.assert_allclose(np.triu(front)[width:, width:], left, rtol=0, atol=1e-12 * size)


@given(
    n=st.integers(1, 40),
    density=st.floats(0, 0.5),
    seed=st.integers(0, 2**31),
    hubs=st.integers(0, 2),
)
def test_any_symmetric_pattern_is_solved(n, density, seed, hubs):
    rng = np.random.default_rng(seed)
    dense = np.triu(rng.random((n, n)) < density, 1)
    dense[:hubs] = True
    matrix = definite(scipy.sparse.coo_array(np.triu(dense, 1)), seed)
    x = rng.standard_normal((n, 3))
    solved = CholeskyFactor(matrix).solve(matrix @ x)
    # Rows of at most 40 entries below one, dominant by 0.1: the condition number is below 1000.
    np.testing.assert_allclose(solved, x, rtol=0, atol=1e-11)


_eliminate = compiled.Kernel(eliminate, relaxed=True)
