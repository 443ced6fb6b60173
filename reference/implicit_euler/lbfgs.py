"""L-BFGS that starts from M + h² L, the matrix of the local/global iterations.

Liu, Bouaziz, Kavan 2017, "Quasi-Newton Methods for Real-Time Simulation of Hyperelastic Materials":
a local/global iteration is a quasi-Newton step with M + h² L for the Hessian. The last few steps
and changes of the gradient correct it by the two loops of Nocedal 1980, and a line search makes
sure of descent.
"""

from collections import deque
from collections.abc import Iterator

import numpy as np

from ..arguments import FloatArray
from ..mass_spring import MassSpring
from .factor_cache import global_factor
from .line_search import line_search
from .objective import Iterate, Objective

WINDOW = 5  # steps remembered, as in the paper

Pair = tuple[FloatArray, FloatArray]


class LBFGS:
    """L-BFGS iterations; M + h² L is factorised here, once for all steps."""

    default_iterations = 300

    def __init__(self, system: MassSpring, h: float) -> None:
        """Factorise M + h² L.

        Raises:
            NotPositiveDefiniteError: if it is singular to rounding, masses being too small.
        """
        self._factor = global_factor(system, h)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then iterate after iterate; once stuck the last again."""
        iterate, pairs = objective.start, deque[Pair](maxlen=WINDOW)
        while True:
            yield iterate
            before = iterate
            iterate = line_search(objective, before, self._step(before.gradient, pairs))
            s, t = iterate.positions - before.positions, iterate.gradient - before.gradient
            if np.sum(s * t) > 0:  # else the pair would not keep the matrix positive definite
                pairs.append((s, t))

    def _step(self, gradient: FloatArray, pairs: deque[Pair]) -> FloatArray:
        """Return -H grad g, H being (M + h² L)^-1 corrected by the pairs."""
        q, shares = gradient, []
        for s, t in reversed(pairs):
            shares.append(np.sum(s * q) / np.sum(s * t))
            q = q - shares[-1] * t
        r = self._factor.solve(q)
        for (s, t), share in zip(pairs, reversed(shares), strict=True):
            r = r + s * (share - np.sum(t * r) / np.sum(s * t))
        return -r
