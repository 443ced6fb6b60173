"""Truncated Newton by conjugate gradients, for systems too large to factorise their Hessian.

The Newton system H s = -grad g(x), with the exact Hessian H = M + h² K, is solved inexactly (Dembo
and Steihaug 1983, "Truncated-Newton Algorithms for Large-Scale Unconstrained Optimization"). The
relative tolerance falls with the square root of the gradient: convergence is superlinear. The
conjugate gradients stop at a direction of non-positive curvature.

The preconditioner is M + h² L, the matrix of the local/global iterations. It is factorised once for
all steps and has a third of the rows of H. Its factor is rounded to single precision: half the
memory to read, and the preconditioner is as good. The first conjugate gradient iterate is a
multiple of a local/global step. H is never assembled, only multiplied with, spring by spring.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy import uint64 as at

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..mass_spring import MassSpring, is_slack, spring_frame, transverse_share
from ..quaternion import add, dot, load_vector, scale, store_vector, subtract
from .factor_cache import GlobalMatrixSolver
from .line_search import inner_product, line_search
from .objective import Iterate, Objective

# Residual of the Newton system relative to the gradient, in the norm of the preconditioner's
# inverse. The step is then about as accurate, relative to its length.
LARGEST_TOLERANCE = 0.1
TOLERANCE_FACTOR = 0.3  # times the square root of |grad g(x)| / |grad g(y)|
# A step truncated here is still a direction of descent, which the line search shortens.
CG_ITERATION_LIMIT = 500


class NewtonCG(GlobalMatrixSolver):
    """Truncated Newton iterations."""

    default_iterations = 100
    single_precision = True

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate, workspace = objective.start, CGVectors.of(objective.effective)
        while True:
            yield iterate
            relative = iterate.gradient_norm / (objective.inertial.gradient_norm or 1.0)
            tolerance = min(LARGEST_TOLERANCE, TOLERANCE_FACTOR * np.sqrt(relative))
            step = self._step(objective, iterate, tolerance, workspace)
            iterate = line_search(objective, iterate, step)

    def _step(
        self, objective: Objective, iterate: Iterate, tolerance: float, workspace: "CGVectors"
    ) -> FloatArray:
        """Return s with H s = -grad g to a relative tolerance, truncated at negative curvature."""
        arrays, (blocks, unknowns, s, r, z, p, Hp) = objective.effective.arrays, workspace
        _blocks(iterate.positions, objective.h**2, arrays, blocks)
        np.negative(iterate.gradient, out=r)
        self._factor.solve_into(r, p, unknowns)
        s[:] = 0.0
        size = _inner(r, p)
        limit = tolerance * tolerance * size
        for k in range(CG_ITERATION_LIMIT):
            curvature = _product(blocks, p, arrays.masses, arrays.springs, arrays.pinned, Hp)
            if not curvature > 0:
                return s if k else p
            _update(size / curvature, p, Hp, s, r)
            self._factor.solve_into(r, z, unknowns)
            before, size = size, _inner(r, z)
            if size <= limit:
                break
            _turn(size / before, z, p)
        return s


class CGVectors(NamedTuple):
    """Memory for the steps of an objective: fresh memory takes longer than the arithmetic.

    Vectors have shape (particle, 3).
    """

    blocks: FloatArray  # of the springs, see `factored_blocks`, (spring, 4)
    unknowns: FloatArray  # workspace of solves with the factor, (particle, 4)
    s: FloatArray  # the step
    r: FloatArray  # the residual -grad g - H s
    z: FloatArray  # the residual times the preconditioner's inverse
    p: FloatArray  # the direction
    Hp: FloatArray

    @classmethod
    def of(cls, system: MassSpring) -> "CGVectors":
        """Return memory for the vectors of a system."""
        blocks, n = np.empty((len(system.springs), 4)), system.particle_count
        return cls(blocks, np.empty((n, 4)), *np.empty((5, n, 3)))


def factored_blocks(x, hh, system, blocks):
    """Fill v and t of each spring's block h² K_i = t I + v v', shape (spring, 4); zero if slack."""
    for s in range(len(system.springs)):
        length, u = spring_frame(x, at(system.springs[s, 0]), at(system.springs[s, 1]))
        k, rest_length = hh * system.stiffnesses[s], system.rest_lengths[s]
        if is_slack(length, rest_length, system.tension_only[s]):
            k = 0.0
        blocks[s, 3] = transverse = k * transverse_share(length, rest_length)
        store_vector(blocks, s, scale(math.sqrt(k - transverse), u))


def hessian_product(blocks, p, masses, springs, pinned, product):
    """Fill H p for p zero at the pins, zero there too; return the curvature p' H p."""
    curvature = 0.0
    for particle in range(len(p)):
        pull = scale(masses[particle], load_vector(p, particle))
        store_vector(product, particle, pull)
        curvature += dot(load_vector(p, particle), pull)
    for s in range(len(springs)):
        i, j, v = at(springs[s, 0]), at(springs[s, 1]), load_vector(blocks, s)
        d = subtract(load_vector(p, i), load_vector(p, j))
        pull = add(scale(blocks[s, 3], d), scale(dot(v, d), v))
        store_vector(product, i, add(load_vector(product, i), pull))
        store_vector(product, j, subtract(load_vector(product, j), pull))
        curvature += dot(d, pull)
    for pin in pinned:
        store_vector(product, pin, (0.0, 0.0, 0.0))
    return curvature


def update(length, p, Hp, s, r):
    """Add `length` times p to s, and subtract `length` times H p from r."""
    for i in range(len(p)):
        for c in range(3):
            s[i, c] += length * p[i, c]
            r[i, c] -= length * Hp[i, c]


def turn(share, z, p):
    """Replace p by z + share p."""
    for i in range(len(p)):
        for c in range(3):
            p[i, c] = z[i, c] + share * p[i, c]


_blocks = Kernel(factored_blocks)
_product = Kernel(hessian_product)
_update = Kernel(update, relaxed=True)
_inner = Kernel(inner_product, relaxed=True)
_turn = Kernel(turn, relaxed=True)
