"""Backtracking line search: halve a descent step until g decreases enough (Armijo 1966).

Close to the minimum the changes of g are smaller than its rounding error. There the slope decides,
by the approximate Wolfe condition of Hager and Zhang 2005, "A New Conjugate Gradient Method with
Guaranteed Descent".
"""

import numpy as np

from ..arguments import FloatArray
from .objective import Iterate, Objective

# Least decrease relative to the slope's prediction, the usual choice (Nocedal & Wright 2006, 3.1).
ARMIJO = 1e-4
# The last length is 1e-12 of the step: a shorter one changes positions by rounding only.
HALVINGS = 40


def line_search(objective: Objective, start: Iterate, step: FloatArray) -> Iterate:
    """Return an acceptable iterate along a descent step, or the start if there is none.

    It is acceptable if g decreased enough or, within rounding, if the slope at the end is small.
    """
    slope, length = float(np.sum(start.gradient * step)), 1.0
    for _ in range(HALVINGS):
        end = objective.iterate_at(start.positions + length * step)
        rise = end.value - start.value
        if rise <= ARMIJO * length * slope or (
            rise <= end.value_floor
            and float(np.sum(end.gradient * step)) <= (2 * ARMIJO - 1) * slope
        ):
            return end
        length /= 2
    return start
