"""Conjugate gradients for the matrix of Gauss-Newton, M + h² K without geometric terms.

The matrix is never assembled. With L_i L_i' its 3 x 3 diagonal block at particle i, the unknowns
are scaled to L_i' dx_i (block Jacobi). The scaled matrix is the identity plus, for each spring from
i to j, a block -a b' and its transpose,

    a = (h² k)^1/2 L_i^-1 u,    b = (h² k)^1/2 L_j^-1 u.

Since (a·p_i - b·p_j)² <= 2 (a·p_i)² + 2 (b·p_j)², its eigenvalues are at most 2. Since L_i L_i' is
at most m_i + h² (sum of k over i's springs), they are at least the smallest ratio of m_i to this
sum. Neither bound depends on positions.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy import uint64 as at

from ..backend.compiled import relaxed, uncounted
from ..backend.simd.vectors import dot_rows, load_row, store_row, subtract_scaled
from ..mass_spring import MassSpring, is_slack, spring_frame
from ..quaternion import add, load_vector, scale, store_vector
from ..sparse import CholeskyFactor
from .objective import effective_stiffnesses
from .terms import EPS

# Scaled residual relative to the scaled gradient. The gradient itself has such a rounding error, as
# a sum of four or more terms for each particle.
TOLERANCE = 4 * EPS
# Multiplications of a product with the scaled matrix for each spring. For each unknown, the number
# of multiplications that take as long as assembly and triangular solves, measured on ropes and
# cloths.
SPRING_MULTIPLICATIONS, UNKNOWN_MULTIPLICATIONS = 12, 2000


def iteration_limit(system: MassSpring, h: float, factor: CholeskyFactor) -> int:
    """Return the most iterations of a step, 0 where a factor is expected to be faster.

    `factor` has the pattern of the matrix. The rule is stated in docs/implicit_euler.md.
    """
    bound = iteration_bound(system, h)
    springs, unknowns = len(system.with_separate_dampers.springs), len(factor.pattern.order)
    direct = factor.multiplications + UNKNOWN_MULTIPLICATIONS * unknowns
    return math.ceil(bound) if SPRING_MULTIPLICATIONS * springs * bound <= direct else 0


@np.errstate(all="ignore")
def iteration_bound(system: MassSpring, h: float) -> float:
    """Return a number of iterations that suffices in exact arithmetic, for all positions.

    If the largest eigenvalue is c times the smallest, n iterations divide the residual by at least
    exp(2 n / c^1/2) / (2 c^1/2). Infinite or NaN where h² k overflows.
    """
    springs = system.with_separate_dampers
    k = np.repeat(effective_stiffnesses(springs, h), 2)
    sums = h * h * np.bincount(springs.springs.ravel(), k, system.particle_count)
    ratios = (sums / system.free_masses)[system.free]
    root = math.sqrt(2.0 + 2.0 * float(ratios.max(initial=0.0)))
    return 0.5 * root * math.log(2.0 * root / TOLERANCE)


class CGWorkspace(NamedTuple):
    """Workspace of conjugate gradients; the fourth number of each row stays zero."""

    rows: np.ndarray  # a and b of each spring, (2 spring, 4)
    diagonals: np.ndarray  # the diagonals of the L_i, inverted, (particle, 3)
    lower: np.ndarray  # the entries yx, zx, zy of the L_i, (particle, 3)
    vectors: np.ndarray  # residual, solution, direction and product, (4, particle, 4)


def cg_workspace(particles, springs):
    """Return the workspace for a number of particles and of springs."""
    blocks = np.empty((particles, 3)), np.empty((particles, 3))
    return CGWorkspace(np.empty((2 * springs, 4)), *blocks, np.zeros((4, particles, 4)))


@relaxed
@uncounted
def linearised_step(start, terms, roots, limit, workspace, step):
    """Fill in the step to the minimum of g with the springs linearised at the start.

    `start` is of positions and the gradient, zero at the pins; `roots` are (h² k)^1/2 of the
    springs. Return whether at most `limit` iterations bring the residual within the tolerance.
    """
    (x, gradient), (rows, diagonals, lower, vectors) = start, workspace
    _, _, (_, _, masses), springs, (rest_lengths, _, tension_only), pinned = terms
    elastic = rest_lengths, roots, tension_only
    residual, solution = vectors[0], vectors[1]
    fill_springs_and_blocks(x, masses, springs, elastic, pinned, rows, diagonals, lower)
    for i in range(len(x)):
        factorize_block(diagonals, lower, i)
        store_vector(residual, i, eliminate(diagonals, lower, i, load_vector(gradient, i)))
    for s in range(len(springs)):
        for end in range(2):
            row = at(2 * s + end)
            a = eliminate(diagonals, lower, at(springs[s, end]), load_vector(rows, row))
            store_vector(rows, row, a)
    converged = conjugate_gradients(springs, rows, limit, vectors)
    for i in range(len(x)):
        correction = substitute(diagonals, lower, i, load_vector(solution, i))
        store_vector(step, i, scale(-1.0, correction))
    return converged


def fill_springs_and_blocks(x, masses, springs, elastic, pinned, rows, diagonals, lower):
    """Fill in (h² k)^1/2 u of each spring, zero if slack, in two rows, and the diagonal blocks.

    A block has a diagonal xx, yy, zz, infinite at the pins, and yx, zx, zy below. The
    second array of `elastic` holds (h² k)^1/2.
    """
    rest_lengths, roots, tension_only = elastic
    for i in range(len(x)):
        store_vector(diagonals, i, (masses[i], masses[i], masses[i]))
        store_vector(lower, i, (0.0, 0.0, 0.0))
    for i in pinned:
        store_vector(diagonals, i, (math.inf, math.inf, math.inf))
    for s in range(len(springs)):
        length, u = spring_frame(x, at(springs[s, 0]), at(springs[s, 1]))
        slack = is_slack(length, rest_lengths[s], tension_only[s])
        a = scale(0.0 if slack else roots[s], u)
        squares = a[0] * a[0], a[1] * a[1], a[2] * a[2]
        products = a[1] * a[0], a[2] * a[0], a[2] * a[1]
        for end in range(2):
            particle = at(springs[s, end])
            store_vector(rows, at(2 * s + end), a)
            rows[at(2 * s + end), 3] = 0.0
            store_vector(diagonals, particle, add(load_vector(diagonals, particle), squares))
            store_vector(lower, particle, add(load_vector(lower, particle), products))


def factorize_block(diagonals, lower, i):
    """Replace a block by its Cholesky factor, with the inverses of the diagonal."""
    (xx, yy, zz), (yx, zx, zy) = load_vector(diagonals, i), load_vector(lower, i)
    p = 1.0 / math.sqrt(xx)
    yx, zx = yx * p, zx * p
    q = 1.0 / math.sqrt(yy - yx * yx)
    zy = (zy - zx * yx) * q
    store_vector(diagonals, i, (p, q, 1.0 / math.sqrt(zz - zx * zx - zy * zy)))
    store_vector(lower, i, (yx, zx, zy))


def eliminate(inverses, lower, i, v):
    """Return L_i^-1 v."""
    (p, q, r), (yx, zx, zy) = load_vector(inverses, i), load_vector(lower, i)
    x = p * v[0]
    y = q * (v[1] - yx * x)
    return x, y, r * (v[2] - zx * x - zy * y)


def substitute(inverses, lower, i, v):
    """Return L_i'^-1 v."""
    (p, q, r), (yx, zx, zy) = load_vector(inverses, i), load_vector(lower, i)
    z = r * v[2]
    y = q * (v[1] - zy * z)
    return p * (v[0] - yx * y - zx * z), y, z


@uncounted
def conjugate_gradients(springs, rows, limit, vectors):
    """Solve the scaled system from zero (Hestenes and Stiefel 1952); see `linearised_step`."""
    size = vectors[0].size
    r, z = vectors[0].reshape(size), vectors[1].reshape(size)
    p, q = vectors[2].reshape(size), vectors[3].reshape(size)
    length = math.sqrt(inner(r, r))
    if not 0.0 < length < math.inf:
        return False
    for k in range(len(r)):
        r[k] /= length  # no number below leaves the floats
        z[k], p[k] = 0.0, r[k]
    size = inner(r, r)
    for _ in range(limit):
        multiply(springs, rows, vectors[2], vectors[3])
        step, before = size / inner(p, q), size
        for k in range(len(r)):
            z[k] += step * p[k]
            r[k] -= step * q[k]
        size = inner(r, r)
        if size <= TOLERANCE * TOLERANCE:
            for k in range(len(r)):
                z[k] *= length
            return True
        for k in range(len(r)):
            p[k] = r[k] + size / before * p[k]
    return False


def inner(a, b):
    """Return the scalar product of two rows."""
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


def multiply(springs, rows, direction, product):
    """Set the product to the scaled matrix times the direction, both of shape (particle, 4)."""
    for k in range(len(direction)):
        store_row(product, at(k), load_row(direction, at(k)))
    for s in range(len(springs)):
        i, j = at(springs[at(s), 0]), at(springs[at(s), 1])
        a, b = load_row(rows, at(2 * s)), load_row(rows, at(2 * s + 1))
        p, q = dot_rows(a, load_row(direction, i)), dot_rows(b, load_row(direction, j))
        store_row(product, i, subtract_scaled(load_row(product, i), q, a))
        store_row(product, j, subtract_scaled(load_row(product, j), p, b))
