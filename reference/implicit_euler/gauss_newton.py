"""Gauss-Newton: a step of implicit Euler with the springs linearised at the start of the step.

The step solves (Baraff and Witkin 1998, without geometric stiffness; MuJoCo's integrator
`discrete`)

    (M + h C + h² J' k J) dv = h (f - h J' k J v_n),

where J is the Jacobian of the lengths, and f all forces with the dampers' -C v_n. Conjugate
gradients solve it where h² k is small beside the masses, and a factor elsewhere: `iteration_limit`
in `conjugate_gradients` decides, once for a system and h. See docs/implicit_euler.md.
"""

import functools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..mass_spring import MassSpring
from ..sparse.multifrontal import factorize
from .conjugate_gradients import iteration_limit, linearised_step
from .factor_cache import hessian_factor
from .objective import Iterate, Objective
from .stopping import GO_ON
from .terms import fill_gradient, move_along
from .whole_step import (
    Iteration,
    fill_descent,
    fill_hessian,
    iterate_by,
    packed_model,
    step_by,
)


class GaussNewton:
    """Gauss-Newton iterations from x_n, by default a single iteration."""

    default_iterations = 1

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the sparsity pattern, which the matrices of all steps share."""
        self._analysed = hessian_factor(system)
        self._model = system, h, self._analysed.pattern
        self.limit_products(iteration_limit(system, h, self._analysed))

    def limit_products(self, limit: int) -> None:
        """Make a factor if conjugate gradients need more than `limit` iterations; 0 for none."""
        self.product_limit = limit
        self._memory = packed_model(*self._model, limit)

    @functools.cached_property
    def _factored(self) -> FloatArray:
        """The model for a factor, where conjugate gradients do not suffice."""
        return packed_model(*self._model, 0)

    def step(
        self, motion: Any, external: FloatArray, targets: FloatArray, *arguments: Any
    ) -> tuple[FloatArray, FloatArray, bool, int] | None:
        """Return the result of `step_by` for its arguments after the first two; None if pins move.

        Moving pins pull in the first iteration only, see `iterates`; the kernel has no such case.
        """
        if len(targets):
            return None
        end = _step(self._memory, motion, external, targets, *arguments)
        if end[-1] == GO_ON:
            end = _step(self._factored, motion, external, targets, *arguments)
        return end

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield x_n with the pins at their targets, then the iterate after each iteration.

        Where the matrix is singular to rounding, yield the last iterate again.
        """
        x, y, free = objective.x_n, objective.y, objective.system.free[:, None]
        gradient = objective.iterate_at(x).gradient
        gradient = gradient + objective.pin_gradient_at(x)
        iterate = objective.start
        while True:
            yield iterate
            start = x, gradient, iterate.value
            end, accepted, number = _iteration(self._memory, start, objective.terms, 0.0)
            if number == math.inf:
                end, accepted, _ = _iteration(self._factored, start, objective.terms, 0.0)
            if accepted:
                iterate = objective.iterate_at(np.where(free, end[0], y))
                x, gradient = iterate.positions, iterate.gradient


def gauss_newton_iteration(model, buffers, start, terms, shift):
    """Fill in the end and return as an `Iteration` does, infinity if a factor is needed.

    No end is accepted where the matrix is singular to rounding: the masses vanish beside h² k.
    """
    x, gradient, value = start
    if model.product_limit > 0:
        limit, workspace, step = model.product_limit, buffers.products, buffers.step
        if not linearised_step((x, gradient), terms, model.roots, limit, workspace, step):
            return (value, 0.0, 0.0), False, math.inf
    else:
        fill_hessian(model, buffers, x, terms, False)
        if factorize(model.factor, buffers.data, buffers.values, buffers.scratch) >= 0:
            return (value, 0.0, 0.0), False, shift
        fill_descent(model.factor, buffers, gradient)
    move_along(x, 1.0, buffers.step, buffers.end)
    return fill_gradient(buffers.end, terms, buffers.end_gradient), True, shift


def never(model, buffers, x, terms):
    """Refuse no end: linearised springs have no saddle."""
    return False


GAUSS_NEWTON = Iteration(gauss_newton_iteration, never)
_step = Kernel(step_by, constants=(GAUSS_NEWTON,), label="linearised steps of implicit Euler")
_iteration = Kernel(iterate_by, constants=(GAUSS_NEWTON,), label="linearised iterations")
