"""A step in one kernel: what all methods of it share.

A method is an `Iteration`: how an iterate follows from the last, and which ends are refused.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..arguments import FloatArray
from ..backend.memory import packed, part
from ..explicit import overwrite
from ..mass_spring import MassSpring, SystemArrays, fill_blocks, sum_springs
from ..sparse.assembly import add_blocks
from ..sparse.dissection import Graph
from ..sparse.multifrontal import Scratch, scratch_for
from ..sparse.symbolic import Supernodes, SymbolicFactor, UpdateTree
from ..sparse.triangular import REGISTER, RIGHT_HAND_SIDES, solve
from .conjugate_gradients import CGWorkspace, cg_workspace
from .objective import effective_stiffnesses
from .stopping import AT_ROUNDING, CONVERGED, DIVERGED, GO_ON, SADDLE, outcome_at
from .terms import (
    blend_dampers,
    fill_gradient,
    inertial_positions,
    is_finite,
    move_free,
    rounding_coefficients,
    standing,
    step_end,
)


class Iteration(NamedTuple):
    """The kernels of a method."""

    # (model, buffers, start, terms, shift) -> (g, |grad g| and the largest |x_i| of the end, which
    # it fills in), whether the end is accepted, the shift for the next iteration, infinity to give
    # up. `start` is of positions, gradient and g.
    advance: Any
    refuses: Any  # (model, buffers, positions, terms) -> whether the positions are no minimum


class Model(NamedTuple):
    """What all steps of a length share; dampers of tension-only springs are separate springs."""

    system: SystemArrays
    stiffnesses: np.ndarray  # k + c/h [N/m], (spring,)
    roots: np.ndarray  # (h² (k + c/h))^1/2 [kg^1/2], (spring,)
    free: np.ndarray  # whether each particle is free, (particle,)
    # The pattern of the Hessian, see `BlockSum`: the places of the four blocks of each spring,
    # (spring, 4); its ends, -1 for a pin, (spring, 2); where columns begin, (particle + 1,).
    places: np.ndarray
    ends: np.ndarray
    starts: np.ndarray
    diagonal: np.ndarray  # the places of the diagonal in the data of the Hessian, (3 particle,)
    masses: np.ndarray  # on the diagonal [kg], 1 at the pins, (3 particle,)
    sums: np.ndarray  # see `sum_springs`, dampers left out, (particle, 2)
    factor: SymbolicFactor
    damped: bool
    most_springs: int  # the most springs of a particle
    product_limit: int  # most iterations of conjugate gradients in a linearised step, 0 for none


def packed_model(
    system: MassSpring, h: float, factor: SymbolicFactor, product_limit: int = 0
) -> FloatArray:
    """Return the arrays of a `Model` as one block of memory."""
    separate = system.with_separate_dampers
    arrays, assembly = separate.arrays, separate.free_blocks
    graph, order, place, blocks, updates = factor
    degrees = np.bincount(arrays.springs.ravel(), minlength=1)
    sizes = blocks.tallest, updates.highest, updates.entries
    numbers = *sizes, system.damped, degrees.max(), product_limit
    return packed(
        np.array(numbers, dtype=np.int64),
        *arrays,
        effective_stiffnesses(separate, h),
        system.free,
        *assembly.places,
        assembly.diagonal.astype(np.int64),
        np.repeat(system.free_masses, 3),
        *graph,
        order,
        place,
        *blocks[:3],
        *updates[:2],
        separate.spring_sums,
        h * np.sqrt(effective_stiffnesses(separate, h)),
    )


def model_in(memory):
    """Return the `Model` in a block of memory."""
    numbers = part(memory, 0, np.int64)
    system = SystemArrays(
        part(memory, 1, np.float64),
        pairs(part(memory, 2, np.int64), 2),
        part(memory, 3, np.float64),
        part(memory, 4, np.float64),
        part(memory, 5, np.float64),
        part(memory, 6, np.bool_),
        part(memory, 7, np.int64),
        part(memory, 8, np.float64),
    )
    graph = Graph(part(memory, 16, np.int32), part(memory, 17, np.int32))
    columns, starts = part(memory, 20, np.int32), part(memory, 21, np.int64)
    blocks = Supernodes(columns, starts, part(memory, 22, np.int32), numbers[0])
    begins, children = part(memory, 23, np.int64), part(memory, 24, np.int32)
    updates = UpdateTree(begins, children, numbers[1], numbers[2])
    order, place = part(memory, 18, np.int32), part(memory, 19, np.int32)
    return Model(
        system,
        part(memory, 9, np.float64),
        part(memory, 26, np.float64),
        part(memory, 10, np.bool_),
        pairs(part(memory, 11, np.int32), 4),
        pairs(part(memory, 12, np.int32), 2),
        part(memory, 13, np.int32),
        part(memory, 14, np.int64),
        part(memory, 15, np.float64),
        pairs(part(memory, 25, np.float64), 2),
        SymbolicFactor(graph, order, place, blocks, updates),
        numbers[3] > 0,
        numbers[4],
        numbers[5],
    )


def pairs(values, count):
    """Return an array as rows of so many."""
    return values.reshape((len(values) // count, count))


def step_by(method, memory, motion, external, targets, begin, h, stop):
    """Make a step of implicit Euler by a method.

    `motion` is x_n and v_n. `targets` are the positions of the pins at the end of the step, none if
    pins stay. `begin` is where the free particles begin, empty for y. `stop` is the tolerance and
    the limit of iterations.

    Returns:
        positions and velocities, (2, particle, 3); the residual and g before and after each
        iteration, (2, iterations + 1), empty if the start overflows; whether the gradient is at the
        floor; the outcome.
    """
    model, (x_n, v_n) = model_in(memory), motion
    system, rest_lengths, constant = model.system, model.system.rest_lengths, 0.0
    sums = model.sums
    if model.damped:
        rest_lengths, constant = blend_dampers(x_n, h, model.stiffnesses, system)
        sums = sum_springs(system.masses, system.springs, rest_lengths, model.stiffnesses)
    y = inertial_positions(x_n, v_n, h, system.pinned, targets)
    elastic = rest_lengths, model.stiffnesses, system.tension_only
    terms = h, constant, (y, external, system.masses), system.springs, elastic, system.pinned
    floor = rounding_coefficients(y, external, h, system.masses, sums, model.free)
    buffers, history, x = buffers_for(model, len(y)), np.empty((2, stop[1] + 1)), y.copy()
    start = begin, x
    count, at_floor, outcome = minimise(method, model, buffers, start, terms, floor, history, stop)
    return *step_end(x_n, x, h, history[:, : count + 1].copy()), at_floor, outcome


class Buffers(NamedTuple):
    """What an iteration writes to."""

    blocks: np.ndarray  # h² times the stiffness of each spring [kg], (spring, 3, 3)
    data: np.ndarray  # the entries of the Hessian
    unshifted: np.ndarray  # the diagonal of the Hessian, (3 particle,)
    values: np.ndarray  # the entries of the factor
    scratch: Scratch
    # A solve with the factor always has three right-hand sides, here a gradient and two zeros.
    right: np.ndarray  # (3 particle, RIGHT_HAND_SIDES)
    unknowns: np.ndarray  # (3 particle, REGISTER)
    solution: np.ndarray  # (3 particle, RIGHT_HAND_SIDES)
    gradient: np.ndarray  # at the iterate, (particle, 3)
    step: np.ndarray  # from the iterate to the end, (particle, 3)
    end: np.ndarray  # positions after the iteration, (particle, 3)
    end_gradient: np.ndarray  # (particle, 3)
    workspace: np.ndarray  # of `rounding_bounds`, (2, particle)
    products: CGWorkspace


def buffers_for(model, n):
    """Return buffers for the iterations of n particles, either for a factor or for products."""
    pattern, factored = model.factor, model.product_limit == 0
    rows = 3 * n if factored else 0
    return Buffers(
        np.empty((len(model.places) if factored else 0, 3, 3)),
        np.empty(9 * model.starts[n] if factored else 0),
        np.empty(rows),
        np.empty(pattern.updates.entries if factored else 0),
        scratch_for(pattern.blocks, pattern.updates, rows),
        np.zeros((rows, RIGHT_HAND_SIDES)),
        np.empty((rows, REGISTER)),
        np.empty((rows, RIGHT_HAND_SIDES)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((2, n)),
        cg_workspace(0 if factored else n, 0 if factored else len(model.places)),
    )


def minimise(method, model, buffers, start, terms, floor, history, stop):
    """Iterate until `outcome_at` says so; return the number of iterations, at_floor, the outcome.

    `start` is of the positions to begin at, and of x, which is y and becomes the end. `floor` holds
    the two `rounding_coefficients`. The number of iterations is -1 if the start overflows. The
    outcome is GO_ON if the method gives up. An end is tested for a negative eigenvalue unless the
    last two iterations needed no shift.
    """
    (begin, x), gradient = start, buffers.gradient
    value, norm, reach = fill_gradient(x, terms, gradient)
    first, count, best, at_floor, outcome = norm, -1, 0, False, GO_ON
    shift, accepted, convex = 0.0, True, False
    if len(begin) > 0 and is_finite(value, norm, floor[0] + floor[1] * reach):
        move_free(x, begin, model.free)
        value, norm, reach = fill_gradient(x, terms, gradient)
    while outcome == GO_ON:
        bound = floor[0] + floor[1] * reach
        if not is_finite(value, norm, bound):
            return count, at_floor, DIVERGED
        if count >= 0 and accepted:
            overwrite(x, buffers.end)
            overwrite(gradient, buffers.end_gradient)
        count += 1
        residual, at_floor, at_rest = standing(x, norm, bound, terms, first, buffers.workspace)
        history[0, count], history[1, count] = residual, value
        if residual < history[0, best]:
            best = count
        outcome, at_end = outcome_at(count, stop, residual, best, not accepted, at_floor, at_rest)
        solved = outcome in (CONVERGED, AT_ROUNDING)
        if solved and not convex and method.refuses(model, buffers, x, terms):
            outcome = SADDLE if at_end else GO_ON
        if outcome == GO_ON:
            before = shift if count > 0 else math.inf
            start = x, gradient, value
            end, accepted, shift = method.advance(model, buffers, start, terms, shift)
            convex = shift == 0.0 and before == 0.0
            if shift == math.inf:
                return count, at_floor, GO_ON
            if accepted:
                value, norm, reach = end
    return count, at_floor, outcome


def iterate_by(method, memory, start, terms, shift):
    """Return the end of a single iteration with its gradient, and what `advance` returns."""
    model = model_in(memory)
    buffers = buffers_for(model, len(start[0]))
    end, accepted, shift = method.advance(model, buffers, start, terms, shift)
    return (buffers.end, buffers.end_gradient, *end), accepted, shift


def fill_hessian(model, buffers, x, terms, geometric):
    """Fill in the data of the Hessian of g at x, with or without its geometric terms."""
    h, _, _, springs, elastic, _ = terms
    fill_blocks(x, springs, elastic, h * h, geometric, buffers.blocks)
    for e in range(len(buffers.data)):
        buffers.data[e] = 0.0
    add_blocks(buffers.blocks, model.places, model.ends, model.starts, buffers.data)
    for i in range(len(model.masses)):
        buffers.data[model.diagonal[i]] += model.masses[i]


def fill_descent(factor, buffers, gradient):
    """Fill in the solution of H s = -grad g from the factor's values."""
    for i in range(len(gradient)):
        for c in range(3):
            buffers.right[3 * i + c, 0] = -gradient[i, c]
    columns, starts, rows, _ = factor.blocks
    x = buffers.solution
    solve(factor.order, columns, starts, rows, buffers.values, buffers.right, buffers.unknowns, x)
    for i in range(len(gradient)):
        for c in range(3):
            buffers.step[i, c] = x[3 * i + c, 0]
