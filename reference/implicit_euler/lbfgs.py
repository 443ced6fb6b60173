"""L-BFGS with M + h² L, the matrix of the local/global iterations, as the initial Hessian.

A local/global iteration is a quasi-Newton step with M + h² L for the Hessian (Liu, Bouaziz, Kavan
2017, "Quasi-Newton Methods for Real-Time Simulation of Hyperelastic Materials"). The two-loop
recursion of Nocedal 1980 corrects this matrix by the last few steps and changes of the gradient,
and a line search ensures descent.
"""

from collections import deque
from collections.abc import Iterator

import numpy as np

from ..arguments import FloatArray
from .factor_cache import GlobalMatrixSolver
from .line_search import line_search
from .objective import Iterate, Objective

WINDOW = 5  # steps remembered, as in the paper

Pair = tuple[FloatArray, FloatArray]


class LBFGS(GlobalMatrixSolver):
    """L-BFGS iterations."""

    default_iterations = 300

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate, pairs = objective.start, deque[Pair](maxlen=WINDOW)
        while True:
            yield iterate
            before = iterate
            iterate = line_search(objective, before, self._step(before.gradient, pairs))
            s, t = iterate.positions - before.positions, iterate.gradient - before.gradient
            if np.sum(s * t) > 0:  # otherwise the pair makes the matrix indefinite
                pairs.append((s, t))

    def _step(self, gradient: FloatArray, pairs: deque[Pair]) -> FloatArray:
        """Return -H grad g, where H is (M + h² L)^-1 corrected by the pairs."""
        q, weights = gradient, []
        for s, t in reversed(pairs):
            weights.append(np.sum(s * q) / np.sum(s * t))
            q = q - weights[-1] * t
        r = self._factor.solve(q)
        for (s, t), weight in zip(pairs, reversed(weights), strict=True):
            r = r + s * (weight - np.sum(t * r) / np.sum(s * t))
        return -r
