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
    """Return an acceptable iterate along a descent step, or the start if there is none."""
    slope = float(np.sum(start.gradient * step))
    length = 1.0
    for _ in range(HALVINGS):
        end = objective.iterate_at(start.positions + length * step)
        if accepts(start, end, step, slope, length):
            return end
        length /= 2
    return start


def accepts(start: Iterate, end: Iterate, step: FloatArray, slope: float, length: float) -> bool:
    """Return whether g decreased enough or, within rounding, the slope at the end is small."""
    rise = end.value - start.value
    if rise <= ARMIJO * length * slope:
        return True
    end_slope = float(np.sum(end.gradient * step))
    return rise <= end.value_floor and end_slope <= (2 * ARMIJO - 1) * slope
