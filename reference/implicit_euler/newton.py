"""Newton's method on g with its exact Hessian.

Where springs are compressed the Hessian M + h² K may be indefinite. A multiple of M is then added
until the sum is positive definite, a Levenberg shift in the metric of M. An end is accepted only
without a negative eigenvalue, which costs a last factorisation.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..mass_spring import MassSpring
from ..sparse import CholeskyFactor, NotPositiveDefiniteError
from .certificate import rounding_errors
from .factor_cache import hessian_factor
from .line_search import line_search
from .objective import Iterate, Objective

# Shifts of an indefinite Hessian, times M. Growth outruns decay, for few factorisations. Near a
# minimum there is no shift, so none changes the limit of a converging search.
FIRST_SHIFT = 1e-2
SHIFT_GROWTH, SHIFT_DECAY = 4.0, 2.0


class Newton:
    """Newton iterations; the sparsity pattern of the Hessian is analysed once for all steps."""

    default_iterations = 100

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the pattern; store M and the entries of the Hessian's diagonal."""
        self._analysed = hessian_factor(system)
        self._M = np.repeat(system.free_masses, 3)
        self._diagonal = system.with_separate_dampers.free_blocks.diagonal

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate, shift, last_shift = objective.start, 0.0, np.inf
        while True:
            yield iterate
            factor, shift = self._factor(objective.hessian_at(iterate.positions), shift)
            step = -factor.solve(iterate.gradient.ravel()).reshape(-1, 3)
            iterate = line_search(objective, iterate, step)
            iterate.is_convex = shift == last_shift == 0.0
            last_shift = shift

    def is_saddle(self, objective: Objective, iterate: Iterate) -> bool:
        """Return whether the Hessian at an iterate has a negative eigenvalue, beyond rounding."""
        if iterate.is_convex or not objective.system.free.any():
            return False
        hessian = objective.hessian_at(iterate.positions)
        hessian.data[self._diagonal] += rounding_errors(objective, iterate.positions).hessian
        try:
            self._analysed.refactorize(hessian)
        except NotPositiveDefiniteError:
            return True
        return False

    def _factor(self, hessian: Any, shift: float) -> tuple[CholeskyFactor, float]:
        """Return the factor of the Hessian plus a multiple of M, and the multiple.

        The search starts below the last multiple, which so decays when no longer needed.
        """
        shift = shift / SHIFT_DECAY if shift > FIRST_SHIFT else 0.0
        unshifted = hessian.data[self._diagonal]
        while True:
            hessian.data[self._diagonal] = unshifted + shift * self._M
            try:
                return self._analysed.refactorize(hessian), shift
            except NotPositiveDefiniteError:
                shift = max(FIRST_SHIFT, SHIFT_GROWTH * shift)
