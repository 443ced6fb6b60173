"""Backtracking line search: halve a descent step until g decreases enough (Armijo 1966).

Close to the minimum the changes of g are smaller than its rounding error. There the slope decides,
by the approximate Wolfe condition of Hager and Zhang 2005, "A New Conjugate Gradient Method with
Guaranteed Descent".
"""

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from .objective import Iterate, Objective
from .terms import fill_gradient, move_along, rounding_bounds

# Least decrease relative to the slope's prediction, the usual choice (Nocedal & Wright 2006, 3.1).
ARMIJO = 1e-4
# The last length is 1e-12 of the step: a shorter one changes positions by rounding only.
HALVINGS = 40


def line_search(objective: Objective, start: Iterate, step: FloatArray) -> Iterate:
    """Return an acceptable iterate along a descent step, or the start if there is none."""
    at = start.positions, start.gradient, start.value
    end, end_gradient, workspace = *np.empty((2, *step.shape)), np.empty((2, len(step)))
    numbers, accepted = _search(at, step, objective.terms, end, end_gradient, workspace)
    return objective.iterate_of(end, end_gradient, *numbers) if accepted else start


def search_line(start, step, terms, end, end_gradient, workspace):
    """Fill in an end along a descent step and its gradient, (particle, 3).

    `start` is of positions, gradient and g. The workspace is that of `rounding_bounds`.

    Returns:
        g, |grad g| and the largest |x_i| of the end; whether the end is accepted, since g decreased
        enough or, within rounding, the slope there is small.
    """
    x, gradient, value = start
    slope, length = inner_product(gradient, step), 1.0
    end_value, norm, reach, accepted = value, 0.0, 0.0, False
    for _ in range(HALVINGS):
        move_along(x, length, step, end)
        end_value, norm, reach = fill_gradient(end, terms, end_gradient)
        rise = end_value - value
        accepted = rise <= ARMIJO * length * slope
        if not accepted and inner_product(end_gradient, step) <= (2.0 * ARMIJO - 1.0) * slope:
            accepted = rise <= rounding_bounds(end, terms, workspace)[1]
        if accepted:
            break
        length /= 2.0
    return (end_value, norm, reach), accepted


def inner_product(a, b):
    """Return the sum of the products of entries of two arrays (particle, 3)."""
    total = 0.0
    for i in range(len(a)):
        for c in range(3):
            total += a[i, c] * b[i, c]
    return total


_search = Kernel(search_line)
