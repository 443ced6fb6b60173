"""How far to go along a descent step: halved until g decreases enough (Armijo 1966).

Close to the minimum g can no longer tell, since its changes drown in rounding: there the slope
decides (the approximate Wolfe condition of Hager and Zhang 2005, "A New Conjugate Gradient Method
with Guaranteed Descent").
"""

import numpy as np

from ..arguments import FloatArray
from .objective import Iterate, Objective

ARMIJO = 1e-4  # least share of the decrease promised by the slope
HALVINGS = 40


def line_search(objective: Objective, start: Iterate, step: FloatArray) -> Iterate:
    """Return an acceptable iterate along a descent step, or the start itself if there is none."""
    slope = float(np.sum(start.gradient * step))
    length = 1.0
    for _ in range(HALVINGS):
        end = objective._evaluate(start.positions + length * step)
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
