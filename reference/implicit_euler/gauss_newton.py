"""Gauss-Newton: a step of implicit Euler with the springs linearised at the start of the step.

The step solves (Baraff and Witkin 1998, without geometric stiffness; MuJoCo's integrator
`discrete`)

    (M + h C + h² J' k J) dv = h (f - h J' k J v_n),

where J is the Jacobian of the lengths, and f all forces with the dampers' -C v_n. Conjugate
gradients solve it where h² k is small beside the masses, and a factor elsewhere: `iteration_limit`
in `conjugate_gradients` decides, once for a system and h. See docs/implicit_euler.md.
"""

from collections.abc import Iterator

import numpy as np

from ..arguments import FloatArray
from ..mass_spring import MassSpring
from ..sparse import NotPositiveDefiniteError
from .conjugate_gradients import iteration_limit, solve_linearised
from .factor_cache import hessian_factor
from .objective import Iterate, Objective


class GaussNewton:
    """Gauss-Newton iterations from x_n, by default a single iteration."""

    default_iterations = 1

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the sparsity pattern, which the matrices of all steps share."""
        self._analysed = hessian_factor(system)
        self._iteration_limit = iteration_limit(system, h, self._analysed)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield x_n with the pins at their targets, then the iterate after each iteration.

        Where the matrix is singular to rounding, yield the last iterate again.
        """
        x = objective.x_n
        iterate = objective.iterate_at(x)
        gradient = iterate.gradient + objective.pin_gradient_at(x, geometric=False)
        if np.any(objective.y[objective.system.pinned] != x[objective.system.pinned]):
            iterate = objective.iterate_at(np.where(objective.system.free[:, None], x, objective.y))
        while True:
            yield iterate
            try:
                correction = self._correction(objective, x, gradient)
            except NotPositiveDefiniteError:  # the masses vanish beside h² k
                continue
            iterate = objective.iterate_at(iterate.positions - correction)
            x, gradient = iterate.positions, iterate.gradient

    def _correction(self, objective: Objective, x: FloatArray, gradient: FloatArray) -> FloatArray:
        """Return the gradient over the Hessian at x without geometric terms, (particle, 3) [m]."""
        if self._iteration_limit:
            arrays, limit = objective.effective.arrays, self._iteration_limit
            elastic = arrays.rest_lengths, arrays.stiffnesses, arrays.tension_only
            terms = objective.h, arrays.masses, arrays.springs, elastic, arrays.pinned
            correction, converged = solve_linearised(x, gradient, *terms, limit)
            if converged:
                return correction
        factor = self._analysed.refactorize(objective.hessian_at(x, geometric=False))
        return factor.solve(gradient.ravel()).reshape(-1, 3)
