"""Truncated Newton by conjugate gradients, for systems too large to factorise their Hessian.

The Newton system H s = -grad g(x), with the exact Hessian H = M + h² K, is solved inexactly (Dembo
and Steihaug 1983, "Truncated-Newton Algorithms for Large-Scale Unconstrained Optimization"). The
relative tolerance falls with the square root of the gradient: convergence is superlinear. The
conjugate gradients stop at a direction of non-positive curvature.

The preconditioner is M + h² L, the matrix of the local/global iterations. It is factorised once for
all steps and has a third of the rows of H. The first conjugate gradient iterate is a multiple of a
local/global step. H is never assembled, only multiplied with, spring by spring.
"""

from collections.abc import Iterator

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..mass_spring import blocks
from ..quaternion import add, load_vector, scale, store_vector, subtract
from .factor_cache import GlobalMatrixSolver
from .line_search import line_search
from .objective import Iterate, Objective

LARGEST_TOLERANCE = 0.1  # of the error of a step, relative to the step
TOLERANCE_FACTOR = 0.3  # times the square root of the relative gradient
# A step ended here is still a direction of descent, for the line search to shorten.
CG_ITERATION_LIMIT = 500


class NewtonCG(GlobalMatrixSolver):
    """Truncated Newton iterations."""

    default_iterations = 100

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate = objective.start
        while True:
            yield iterate
            relative = iterate.gradient_norm / (objective.inertial.gradient_norm or 1.0)
            tolerance = min(LARGEST_TOLERANCE, TOLERANCE_FACTOR * np.sqrt(relative))
            iterate = line_search(objective, iterate, self._step(objective, iterate, tolerance))

    def _step(self, objective: Objective, iterate: Iterate, tolerance: float) -> FloatArray:
        """Return s with H s = -grad g to a relative tolerance, truncated at negative curvature."""
        arrays, r = objective.effective.arrays, -iterate.gradient
        K = objective.h**2 * blocks(iterate.positions, arrays, True)
        p = self._factor.solve(r)
        s, size = np.zeros_like(r), float(np.sum(r * p))
        limit = tolerance * tolerance * size
        for k in range(CG_ITERATION_LIMIT):
            Hp = _product(K, p, arrays.masses, arrays.springs, arrays.pinned)
            curvature = float(np.sum(p * Hp))
            if not curvature > 0:
                return s if k else p
            s = s + (size / curvature) * p
            r = r - (size / curvature) * Hp
            z = self._factor.solve(r)
            before, size = size, float(np.sum(r * z))
            if size <= limit:
                break
            p = z + (size / before) * p
        return s


def hessian_product(blocks, p, masses, springs, pinned):
    """Return M p + sum of (A_i A_i') x B_i p for p zero at the pins; zero there too."""
    product = np.empty(p.shape)
    for i in range(len(p)):
        store_vector(product, i, scale(masses[i], load_vector(p, i)))
    for s in range(len(springs)):
        i, j, B = springs[s, 0], springs[s, 1], blocks[s]
        a, b, c = subtract(load_vector(p, i), load_vector(p, j))
        pull = (
            B[0, 0] * a + B[0, 1] * b + B[0, 2] * c,
            B[1, 0] * a + B[1, 1] * b + B[1, 2] * c,
            B[2, 0] * a + B[2, 1] * b + B[2, 2] * c,
        )
        store_vector(product, i, add(load_vector(product, i), pull))
        store_vector(product, j, subtract(load_vector(product, j), pull))
    for i in pinned:
        store_vector(product, i, (0.0, 0.0, 0.0))
    return product


_product = Kernel(hessian_product)
