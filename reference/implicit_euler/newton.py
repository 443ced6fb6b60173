"""Newton's method on g with its exact Hessian, a whole step in one kernel.

Where springs are compressed the Hessian M + h² K may be indefinite. A multiple of M is then added
until the sum is positive definite, a Levenberg shift in the metric of M (Nocedal & Wright 2006,
section 3.4). The search ends only without a negative eigenvalue, which may take a last
factorisation.
"""

import math
from collections.abc import Iterator
from typing import Any

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..mass_spring import MassSpring
from ..sparse.multifrontal import factorize
from .factor_cache import hessian_factor
from .line_search import search_line
from .objective import Iterate, Objective
from .terms import hessian_rounding
from .whole_step import (
    Iteration,
    fill_descent,
    fill_hessian,
    iterate_by,
    packed_model,
    step_by,
)

# Shifts of an indefinite Hessian, as multiples of M. Growth outruns decay, for few factorisations.
# The first shift is small beside M: a slightly indefinite Hessian changes little. Near a minimum
# the Hessian is positive definite without a shift, so convergence stays quadratic.
FIRST_SHIFT = 1e-2
SHIFT_GROWTH, SHIFT_DECAY = 4.0, 2.0


class Newton:
    """Newton iterations; the sparsity pattern of the Hessian is analysed once for all steps."""

    default_iterations = 100

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the pattern, and pack the system with it."""
        # The attribute keeps the analysis in the cache for other integrators of the system.
        self._analysed = hessian_factor(system)
        self._memory = packed_model(system, h, self._analysed.pattern)

    def step(self, *arguments: Any) -> tuple[FloatArray, FloatArray, bool, int]:
        """Return the result of `step_by` for its arguments after the first two."""
        return _step(self._memory, *arguments)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate, shift = objective.start, 0.0
        while True:
            yield iterate
            start = iterate.positions, iterate.gradient, iterate.value
            end, accepted, shift = _iteration(self._memory, start, objective.terms, shift)
            iterate = objective.iterate_of(*end) if accepted else iterate


def newton_iteration(model, buffers, start, terms, shift):
    """Fill in the end and return as an `Iteration` does.

    The search for a shift begins below the last shift, so shifts decay when no longer needed. There
    is no end where the shift overflows: the masses vanish beside h² K.
    """
    fill_hessian(model, buffers, start[0], terms, True)
    for i in range(len(model.diagonal)):
        buffers.unshifted[i] = buffers.data[model.diagonal[i]]
    shift = shift / SHIFT_DECAY if shift > FIRST_SHIFT else 0.0
    while not is_factorised(model, buffers, shift):
        shift = max(FIRST_SHIFT, SHIFT_GROWTH * shift)
        if shift == math.inf:
            return (start[2], 0.0, 0.0), False, FIRST_SHIFT
    fill_descent(model.factor, buffers, start[1])
    end = buffers.end, buffers.end_gradient, buffers.workspace
    return *search_line(start, buffers.step, terms, *end), shift


def is_factorised(model, buffers, shift):
    """Factorise the Hessian plus `shift` times M; return whether the sum is positive definite."""
    for i in range(len(model.diagonal)):
        buffers.data[model.diagonal[i]] = buffers.unshifted[i] + shift * model.masses[i]
    return factorize(model.factor, buffers.data, buffers.values, buffers.scratch) < 0


def is_saddle(model, buffers, x, terms):
    """Return whether the Hessian at x has a negative eigenvalue, beyond rounding."""
    rest_lengths, sizes = model.system.rest_lengths, buffers.workspace[0]
    error = hessian_rounding(x, rest_lengths, terms, model.free, model.most_springs, sizes)
    fill_hessian(model, buffers, x, terms, True)
    for i in model.diagonal:
        buffers.data[i] += error
    return factorize(model.factor, buffers.data, buffers.values, buffers.scratch) >= 0


NEWTON = Iteration(newton_iteration, is_saddle)
_step = Kernel(step_by, constants=(NEWTON,), label="steps by Newton's method")
_iteration = Kernel(iterate_by, constants=(NEWTON,), label="Newton's iterations")
