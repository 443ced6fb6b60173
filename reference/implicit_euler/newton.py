"""Newton's method on g with its exact Hessian.

Where springs are compressed the Hessian M + h² K may be indefinite; a multiple of M is then added
until it is positive definite, which bends the step towards the inertial one (a Levenberg shift in
the metric of M). The step is halved until g decreases enough (Armijo). Close to the minimum g can
no longer tell, since its changes drown in rounding: there the slope decides (the approximate Wolfe
condition of Hager and Zhang 2005, "A New Conjugate Gradient Method with Guaranteed Descent").
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..arguments import FloatArray
from ..linear_solver import Factor, NotPositiveDefiniteError, factorize
from ..mass_spring import MassSpring
from .objective import Iterate, Objective

ARMIJO = 1e-4  # least share of the decrease promised by the slope
HALVINGS = 40
FIRST_SHIFT = 1e-2  # times M
SHIFT_GROWTH, SHIFT_DECAY = 4.0, 2.0


class Newton:
    """Newton iterations from y."""

    default_iterations = 100

    def __init__(self, system: MassSpring, h: float) -> None:
        """Keep M, which shifts the Hessian."""
        self._M = system.free_mass_matrix

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the start y and then one iterate after the other; the last again once stuck."""
        iterate, shift = objective.start, 0.0
        while True:
            yield iterate
            hessian = objective.hessian(iterate.positions)
            if np.isfinite(hessian.data).all():  # an almost vanished spring may overflow it
                factor, shift = self._factor(hessian, shift)
                step = -factor.solve(iterate.gradient.ravel()).reshape(-1, 3)
                iterate = line_search(objective, iterate, step)

    def _factor(self, hessian: Any, shift: float) -> tuple[Factor, float]:
        """Return the factor of the Hessian plus a multiple of M, and the multiple.

        The first one tried is below that of the last iteration, so that it fades out.
        """
        shift = shift / SHIFT_DECAY if shift > FIRST_SHIFT else 0.0
        while True:
            try:
                return factorize(hessian + shift * self._M if shift else hessian, "scipy"), shift
            except NotPositiveDefiniteError:
                shift = max(FIRST_SHIFT, SHIFT_GROWTH * shift)


def line_search(objective: Objective, start: Iterate, step: FloatArray) -> Iterate:
    """Return an acceptable iterate along a descent step, or the start itself if there is none."""
    slope = float(np.sum(start.gradient * step))
    length = 1.0
    for _ in range(HALVINGS):
        end = objective.evaluate(start.positions + length * step)
        if accepts(start, end, step, slope, length):
            return end
        length /= 2
    return start


def accepts(start: Iterate, end: Iterate, step: FloatArray, slope: float, length: float) -> bool:
    """Return whether g decreased enough or, where rounding hides that, does not climb steeply."""
    rise = end.value - start.value
    if rise <= ARMIJO * length * slope:
        return True
    end_slope = float(np.sum(end.gradient * step))
    return rise <= end.value_floor and end_slope <= (2 * ARMIJO - 1) * slope
