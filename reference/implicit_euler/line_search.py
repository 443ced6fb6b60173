"""Backtracking line search: halve a descent step until g decreases enough (Armijo 1966).

Close to the minimum the changes of g are smaller than its rounding error. There the slope decides,
by the approximate Wolfe condition of Hager and Zhang 2005, "A New Conjugate Gradient Method with
Guaranteed Descent".
"""

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from .objective import Iterate, Objective
from .terms import fill_gradient, rounding_sums

# Least decrease relative to the slope's prediction, the usual choice (Nocedal & Wright 2006, 3.1).
ARMIJO = 1e-4
# The last length is 1e-12 of the step: a shorter one changes positions by rounding only.
HALVINGS = 40


def line_search(objective: Objective, start: Iterate, step: FloatArray) -> Iterate:
    """Return an acceptable iterate along a descent step, or the start if there is none."""
    at = start.positions, start.gradient, start.value
    end, found = _search(at, step, objective.terms)
    return objective.iterate_of(*end) if found else start


def search_line(start, step, terms):
    """Return positions along a descent step, gradient, g, norm and reach, and whether acceptable.

    `start` is of positions, gradient and g.
    """
    end, end_gradient = np.empty(step.shape), np.empty(step.shape)
    room = np.empty(len(step)), np.empty(len(step))
    numbers, found = fill_end(start, step, terms, end, end_gradient, room)
    return (end, end_gradient, *numbers), found


def fill_end(start, step, terms, end, end_gradient, room):
    """Fill in positions and gradient, and return the rest of `search_line`.

    They are acceptable if g decreased enough or, within rounding, if the slope there is small.
    """
    x, gradient, value = start
    slope, length = inner_product(gradient, step), 1.0
    end_value, norm, reach, found = value, 0.0, 0.0, False
    for _ in range(HALVINGS):
        for i in range(len(x)):
            for c in range(3):
                end[i, c] = x[i, c] + length * step[i, c]
        end_value, norm, reach = fill_gradient(end, terms, end_gradient)
        rise = end_value - value
        found = rise <= ARMIJO * length * slope
        if not found and inner_product(end_gradient, step) <= (2.0 * ARMIJO - 1.0) * slope:
            found = rise <= rounding_sums(end, terms, *room)[1]
        if found:
            break
        length /= 2.0
    return (end_value, norm, reach), found


def inner_product(a, b):
    """Return the sum of the products of entries of two arrays (particle, 3)."""
    total = 0.0
    for i in range(len(a)):
        for c in range(3):
            total += a[i, c] * b[i, c]
    return total


_search = Kernel(search_line)
