"""Newton's method on g with its exact Hessian, a whole step in one kernel.

Where springs are compressed the Hessian M + h² K may be indefinite. A multiple of M is then added
until the sum is positive definite, a Levenberg shift in the metric of M. An end is accepted only
without a negative eigenvalue, which may cost a last factorisation.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import Kernel
from ..backend.memory import packed, part
from ..mass_spring import MassSpring, SystemArrays, stiffness_blocks, sum_springs
from ..sparse.assembly import sum_blocks
from ..sparse.dissection import Graph
from ..sparse.multifrontal import factorize
from ..sparse.symbolic import Supernodes, SymbolicFactor, UpdateTree
from ..sparse.triangular import REGISTER, RIGHT_HAND_SIDES, solve
from .factor_cache import hessian_factor
from .line_search import search_line
from .objective import Iterate, Objective, effective_stiffnesses
from .stopping import AT_ROUNDING, CONVERGED, DIVERGED, GO_ON, SADDLE, outcome_at
from .terms import (
    blend_dampers,
    evaluate_objective,
    hessian_rounding,
    inertial_positions,
    is_finite,
    rounding_coefficients,
    standing,
    start_at,
    step_end,
)

# Shifts of an indefinite Hessian, times M. Growth outruns decay, for few factorisations. Near a
# minimum there is no shift, so none changes the limit of a converging search.
FIRST_SHIFT = 1e-2
SHIFT_GROWTH, SHIFT_DECAY = 4.0, 2.0


class Newton:
    """Newton iterations; the sparsity pattern of the Hessian is analysed once for all steps."""

    default_iterations = 100

    def __init__(self, system: MassSpring, h: float) -> None:
        """Analyse the pattern, and pack the system with it."""
        self._analysed = hessian_factor(system)
        self._memory = packed_model(system, h, self._analysed.pattern)

    def step(self, *arguments: Any) -> tuple[FloatArray, FloatArray, bool, int]:
        """Return what `newton_step` returns, of the arguments after its first."""
        return _step(self._memory, *arguments)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate, shift = objective.start, 0.0
        while True:
            yield iterate
            start = iterate.positions, iterate.gradient, iterate.value
            *end, found, shift = _iteration(self._memory, start, objective.terms, shift)
            iterate = objective.iterate_of(*end) if found else iterate


class Model(NamedTuple):
    """What all steps of a length share; dampers of tension-only springs are separate springs."""

    system: SystemArrays
    stiffnesses: np.ndarray  # k + c/h [N/m], (spring,)
    free: np.ndarray  # whether each particle is, (particle,)
    places: np.ndarray  # of the blocks of springs in the Hessian; see `BlockSum`
    ends: np.ndarray
    starts: np.ndarray
    diagonal: np.ndarray  # the places of the diagonal, (3 particle,)
    masses: np.ndarray  # on the diagonal, (3 particle,)
    factor: SymbolicFactor
    damped: bool
    most_springs: int  # of a particle


def packed_model(system: MassSpring, h: float, factor: SymbolicFactor) -> FloatArray:
    """Return the arrays of a `Model` as one block of memory."""
    separate = system.with_separate_dampers
    arrays, assembly = separate.arrays, separate.free_blocks
    graph, order, place, blocks, updates = factor
    degrees = np.bincount(arrays.springs.ravel(), minlength=1)
    numbers = blocks.tallest, updates.highest, updates.entries, system.damped, degrees.max()
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
        part(memory, 10, np.bool_),
        pairs(part(memory, 11, np.int32), 4),
        pairs(part(memory, 12, np.int32), 2),
        part(memory, 13, np.int32),
        part(memory, 14, np.int64),
        part(memory, 15, np.float64),
        SymbolicFactor(graph, order, place, blocks, updates),
        numbers[3] > 0,
        numbers[4],
    )


def pairs(values, count):
    """Return an array as rows of so many."""
    return values.reshape((len(values) // count, count))


def newton_step(memory, x_n, v_n, external, targets, h, stop, from_x_n):
    """Make a step of implicit Euler by Newton's method, from y or from x_n.

    `targets` are the positions of the pins at the end of the step, none if they stay; `stop` is the
    tolerance and the limit of iterations.

    Returns:
        positions and velocities, (2, particle, 3); the residual and g before and after each
        iteration, (2, iterations + 1), empty if the start overflows; whether the gradient is at the
        floor; the outcome.
    """
    model = model_in(memory)
    system, rest_lengths, constant = model.system, model.system.rest_lengths, 0.0
    if model.damped:
        rest_lengths, constant = blend_dampers(x_n, h, model.stiffnesses, system)
    y = inertial_positions(x_n, v_n, h, system.pinned, targets)
    elastic = rest_lengths, model.stiffnesses, system.tension_only
    terms = h, constant, (y, external, system.masses), system.springs, elastic, system.pinned
    sums = sum_springs(system.masses, system.springs, rest_lengths, model.stiffnesses)
    floor = rounding_coefficients(y, external, h, system.masses, sums, model.free)
    x, start = y, evaluate_objective(y, *terms)
    first = start[2]
    history, at_floor, outcome = np.empty((2, 0)), False, DIVERGED
    if is_finite(start[1], first, floor[0] + floor[1] * start[3]):
        if from_x_n:
            x = start_at(x_n, y, model.free)
            start = evaluate_objective(x, *terms)
        x, history, at_floor, outcome = minimise(model, (x, *start), terms, (first, *floor), stop)
    return *step_end(x_n, x, h, history), at_floor, outcome


def minimise(model, start, terms, scale, stop):
    """Iterate from a start until `outcome_at` says so; return as `newton_step` does.

    `start` is of positions, gradient, g, the gradient's norm and the reach; `scale` of the norm at
    y, to which residuals are relative, and the coefficients of the floor.
    """
    x, gradient, value, norm, reach = start
    history, count, best = np.empty((2, 16)), -1, 0
    shift, last_shift, found, at_floor, outcome = 0.0, np.inf, True, False, GO_ON
    convex = False
    end, end_gradient = x, gradient
    while outcome == GO_ON:
        bound = scale[1] + scale[2] * reach
        if not is_finite(value, norm, bound):
            outcome = DIVERGED
            break
        x, gradient, count = end, end_gradient, count + 1
        residual, at_floor, at_rest = standing(x, norm, bound, terms, scale[0])
        if count == history.shape[1]:
            history = np.concatenate((history, np.empty(history.shape)), axis=1)
        history[0, count], history[1, count] = residual, value
        if residual < history[0, best]:
            best = count
        outcome, at_end = outcome_at(count, stop, residual, best, not found, at_floor, at_rest)
        solved = outcome in (CONVERGED, AT_ROUNDING)
        if solved and not convex and is_saddle(model, x, terms):
            outcome = SADDLE if at_end else GO_ON
        if outcome == GO_ON:
            result = newton_iteration(model, (x, gradient, value), terms, shift)
            found, shift = result[5], result[6]
            if found:
                end, end_gradient, value, norm, reach = result[:5]
            convex, last_shift = shift == 0.0 and last_shift == 0.0, shift
    return x, history[:, : count + 1].copy(), at_floor, outcome


def newton_iteration(model, start, terms, shift):
    """Return the next positions, gradient, g, norm and reach, whether they are better, the shift.

    The search for a shift begins below the last, which so decays when no longer needed.
    """
    x, gradient, value = start
    data, values = hessian_data(model, x, terms), np.empty(model.factor.updates.entries)
    unshifted = data[model.diagonal]
    shift = shift / SHIFT_DECAY if shift > FIRST_SHIFT else 0.0
    while True:
        for i in range(len(unshifted)):
            data[model.diagonal[i]] = unshifted[i] + shift * model.masses[i]
        if factorized(model.factor, data, values):
            break
        shift = max(FIRST_SHIFT, SHIFT_GROWTH * shift)
    step = descent(model.factor, values, gradient)
    return *search_line(x, gradient, value, step, terms), shift


def iterate_once(memory, start, terms, shift):
    """Return the same as `newton_iteration`, with the model in a block of memory."""
    return newton_iteration(model_in(memory), start, terms, shift)


def hessian_data(model, x, terms):
    """Return the data of the Hessian of g at x, sparse in the pattern of the model."""
    h, _, _, springs, (rest_lengths, stiffnesses, tension_only), pinned = terms
    system = model.system
    effective = SystemArrays(
        system.masses,
        springs,
        rest_lengths,
        stiffnesses,
        system.dampings,
        tension_only,
        pinned,
        system.gravity,
    )
    K = stiffness_blocks(x, effective, True)
    for s in range(len(K)):
        for a in range(3):
            for b in range(3):
                K[s, a, b] *= h * h
    data = sum_blocks(K, model.places, model.ends, model.starts)
    for i in range(len(model.masses)):
        data[model.diagonal[i]] += model.masses[i]
    return data


def factorized(pattern, data, values):
    """Fill the values of the factor of a matrix; return whether it is positive definite."""
    graph, order, place, blocks, updates = pattern
    return factorize(graph, order, place, blocks, updates, data, values) < 0


def descent(factor, values, gradient):
    """Return the solution of H s = -grad g, (particle, 3), from the factor's values."""
    n, step = 3 * len(gradient), np.empty(gradient.shape)
    b, unknowns = np.zeros((n, RIGHT_HAND_SIDES)), np.empty((n, REGISTER))
    for i in range(n):
        b[i, 0] = -gradient[i // 3, i % 3]
    columns, starts, rows, _ = factor.blocks
    solution = np.empty(b.shape)
    solve(factor.order, columns, starts, rows, values, b, unknowns, solution)
    for i in range(n):
        step[i // 3, i % 3] = solution[i, 0]
    return step


def is_saddle(model, x, terms):
    """Return whether the Hessian at x has a negative eigenvalue, beyond rounding."""
    if not model.free.any():
        return False
    data = hessian_data(model, x, terms)
    error = hessian_rounding(x, model.system.rest_lengths, terms, model.free, model.most_springs)
    for i in model.diagonal:
        data[i] += error
    return not factorized(model.factor, data, np.empty(model.factor.updates.entries))


_step = Kernel(newton_step, label="steps by Newton's method")
_iteration = Kernel(iterate_once, label="Newton's iterations")
