"""Newton's method on g with its exact Hessian.

Where springs are compressed the Hessian M + h² K may be indefinite; a multiple of M is then added
until it is positive definite, which bends the step towards the inertial one (a Levenberg shift in
the metric of M).
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..mass_spring import MassSpring
from ..sparse.linear_solver import Factor, NotPositiveDefiniteError
from .factor_cache import hessian_factor
from .line_search import line_search
from .objective import Iterate, Objective

FIRST_SHIFT = 1e-2  # times M
SHIFT_GROWTH, SHIFT_DECAY = 4.0, 2.0


class Newton:
    """Newton iterations; the Hessian's pattern is analysed here, once for all steps."""

    default_iterations = 100

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the pattern; keep M, which shifts the Hessian, and its place in it."""
        self._analysed = hessian_factor(system)
        self._M = np.repeat(system.free_masses, 3)
        self._diagonal = system.dampers_apart.free_blocks.diagonal

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then iterate after iterate; once stuck the last again."""
        iterate, shift = objective.start, 0.0
        while True:
            yield iterate
            factor, shift = self._factor(objective._hessian(iterate.positions), shift)
            step = -factor.solve(iterate.gradient.ravel()).reshape(-1, 3)
            iterate = line_search(objective, iterate, step)

    def _factor(self, hessian: Any, shift: float) -> tuple[Factor, float]:
        """Return the factor of the Hessian plus a multiple of M, and the multiple.

        The first one tried is below that of the last iteration, so that it fades out.
        """
        shift = shift / SHIFT_DECAY if shift > FIRST_SHIFT else 0.0
        unshifted = hessian.data[self._diagonal]
        while True:
            hessian.data[self._diagonal] = unshifted + shift * self._M
            try:
                return self._analysed.refactorize(hessian), shift
            except NotPositiveDefiniteError:
                shift = max(FIRST_SHIFT, SHIFT_GROWTH * shift)
