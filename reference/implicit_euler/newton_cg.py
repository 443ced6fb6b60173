"""Newton's method on g by conjugate gradients: for cloths too large to factorise their Hessian.

The Newton step solves H s = -grad g(x), H = M + h² K the exact Hessian, as far as is worth while
(Dembo and Steihaug 1983, "Truncated-Newton Algorithms for Large-Scale Unconstrained Optimization"):
to a share of its size that falls with the square root of the gradient, which makes convergence
faster than linear. Where H has no positive curvature along a direction, the step ends before it.

The conjugate gradients are preconditioned by M + h² L, the matrix of the local/global iterations,
which is factorised for all steps and a third as wide as H. It is above H, so that one iteration is
one of these or better; H is never assembled, only multiplied with, spring by spring.
"""

from collections.abc import Iterator

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..mass_spring import MassSpring, _spring_blocks
from ..quaternion import add, load_vector, scale, store_vector, subtract
from .factor_cache import global_factor
from .line_search import line_search
from .objective import Iterate, Objective

LOOSEST = 0.1  # share of the Newton step's size that may be left of its error
TIGHTENING = 0.3  # times the square root of what is left of the gradient
LIMIT = 500  # conjugate gradients in one step


class NewtonCG:
    """Truncated Newton iterations; M + h² L is factorised here, once for all steps."""

    default_iterations = 100

    def __init__(self, system: MassSpring, h: float) -> None:
        """Factorise M + h² L.

        Raises:
            NotPositiveDefiniteError: if it is singular to rounding, masses being too small.
        """
        self._factor = global_factor(system, h)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then iterate after iterate; once stuck the last again."""
        iterate = objective.start
        while True:
            yield iterate
            left = iterate.gradient_norm / (objective.inertial.gradient_norm or 1.0)
            share = min(LOOSEST, TIGHTENING * np.sqrt(left))
            iterate = line_search(objective, iterate, self._step(objective, iterate, share))

    def _step(self, objective: Objective, iterate: Iterate, share: float) -> FloatArray:
        """Return s with H s = -grad g but for a share, or s before H lacks positive curvature."""
        blocks = objective.h**2 * _spring_blocks(objective.effective, iterate.positions)
        arrays, r = objective.effective.arrays, -iterate.gradient
        p = self._factor.solve(r)
        s, size = np.zeros_like(r), float(np.sum(r * p))
        enough = share * share * size
        for k in range(LIMIT):
            Hp = _product(blocks, p, arrays.masses, arrays.springs, arrays.pinned)
            curvature = float(np.sum(p * Hp))
            if not curvature > 0:
                return s if k else p
            s = s + (size / curvature) * p
            r = r - (size / curvature) * Hp
            z = self._factor.solve(r)
            before, size = size, float(np.sum(r * z))
            if size <= enough:
                break
            p = z + (size / before) * p
        return s


def hessian_product(blocks, p, masses, springs, pinned):
    """Return M p plus the sum of (A_i A_i') x B_i p, zero at the pins, where p is as well."""
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
