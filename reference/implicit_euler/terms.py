"""Kernels for the terms of g: value, gradient, effective dampers and rounding errors.

All arguments are in SI units; `objective` defines g. Plain tuples group them:

    terms = h, constant, particles, springs, elastic, pinned
    particles = y, external forces, masses
    elastic = rest lengths, stiffnesses, tension_only

Springs are effective, with dampers included; `constant` is the energy [J] that this leaves out of
E. The external forces include gravity. `hh` stands for h². `reach` is the largest |x_i|.
"""

import math

import numpy as np
from numpy import uint64 as at

from ..explicit import are_bounded
from ..mass_spring import spring_frame, spring_line, spring_stretch
from ..quaternion import add, dot, load_vector, norm, scale, store_vector, subtract

EPS = float(np.finfo(float).eps)
# Bound on the rounding error of the gradient, relative to the norm of its terms. A term is known to
# 14 EPS (see `certificate`), and the sum of 100 springs at a particle to 50 EPS.
SUM_ROUNDING = 64 * EPS
# The rounding error of a Hessian, in EPS: an entry of a spring's block takes at most 60 roundings
# of EPS/2, and the norm of a block is at most three times its largest entry: 3 * 60 / 2 < 128.
HESSIAN_ROUNDING = 128
# Least length [m] to divide by: its square is above the smallest normal number, 2.2e-308.
TINY = 1e-150
# Covers the rounding error of the upper bound of the floor itself.
MARGIN = 1.000001


def inertial_positions(x_n, v_n, h, pinned, targets):
    """Return y = x_n + h v_n, with the pins at their targets, or at x_n if there are none."""
    y = np.empty(x_n.shape)
    move_along(x_n, h, v_n, y)
    for p in range(len(pinned)):
        i = pinned[p]
        store_vector(y, i, load_vector(targets, p) if len(targets) > 0 else load_vector(x_n, i))
    return y


def move_along(x, length, direction, end):
    """Fill in x + length direction, all of shape (particle, 3)."""
    for i in range(len(x)):
        store_vector(end, i, add(load_vector(x, i), scale(length, load_vector(direction, i))))


def move_free(x, begin, free):
    """Move the free particles of x to where they begin."""
    for i in range(len(x)):
        if free[i]:
            store_vector(x, i, load_vector(begin, i))


def step_end(x_n, x, h, history):
    """Return positions and velocities (x - x_n) / h, (2, particle, 3), and the step's history.

    The history is empty where a number exceeds LARGEST_COORDINATE.
    """
    end = np.empty((2, len(x), 3))
    for i in range(len(x)):
        for c in range(3):
            end[0, i, c], end[1, i, c] = x[i, c], (x[i, c] - x_n[i, c]) / h
    return end, (history if are_bounded(end[0], end[1]) else np.empty((2, 0)))


def is_finite(value, gradient_norm, floor_bound):
    """Return whether g, the norm of its gradient and the squared terms of the floor are finite."""
    terms = floor_bound / SUM_ROUNDING
    return math.isfinite(value + gradient_norm + terms * terms)


def standing(x, norm, bound, terms, first, workspace):
    """Return the residual at x, whether the gradient is at the floor, and whether at rest.

    `norm` is |grad g(x)|, `first` is |grad g(y)|, and `bound` is above the floor. The workspace is
    that of `rounding_bounds`.
    """
    at_floor, at_rest, scale = False, False, first
    if norm <= bound or first < bound:
        floor, _ = rounding_bounds(x, terms, workspace)
        at_floor, at_rest = norm <= floor, norm <= EPS / SUM_ROUNDING * floor
        scale = max(first, floor)
    return 0.0 if norm == 0.0 else norm / scale, at_floor, at_rest


def blend_dampers(x_n, h, stiffnesses, system):
    """Return the effective rest lengths, and the constant that completes the square.

    For a damper of stiffness b = c/h and rest length l_n on a spring of stiffness k, rest length r:
    k/2 (l - r)² + b/2 (l - l_n)² = (k + b)/2 (l - rest)² + k b / (k + b) / 2 (r - l_n)².
    """
    rest_lengths = system.rest_lengths.copy()
    constant = 0.0
    for s in range(len(system.springs)):
        damper, stiffness = system.dampings[s] / h, stiffnesses[s]
        if damper > 0.0:
            length, _ = spring_frame(x_n, system.springs[s, 0], system.springs[s, 1])
            share, gap = damper / stiffness, length - system.rest_lengths[s]
            rest_lengths[s] += share * gap
            constant += 0.5 * share * system.stiffnesses[s] * (gap * gap)
    return rest_lengths, constant


def fill_gradient(x, terms, gradient):
    """Fill in grad g, (particle, 3); return g, |grad g| and the largest |x_i|."""
    h, constant, particles, springs, (rest_lengths, stiffnesses, tension_only), pinned = terms
    hh = h * h
    value, largest = add_particles(x, particles, hh, 0, len(x), gradient)
    value += hh * constant
    for s in range(len(springs)):
        i, j, k = at(springs[s, 0]), at(springs[s, 1]), hh * stiffnesses[s]
        value += add_spring(x, i, j, k, rest_lengths[s], tension_only[s], gradient)
    return value, zero_pins(pinned, gradient), math.sqrt(largest)


def evaluate_regions(x, h, particles, elastic, regions, first, last, gradient, sums):
    """Add to the gradient the terms of the particles and springs inside regions first to last - 1.

    Store each region's part of g and largest squared distance from the origin in `sums`, (region,
    2).
    """
    hh = h * h
    for r in range(first, last):
        begin, end = regions.particles[r], regions.particles[r + 1]
        value, largest = add_particles(x, particles, hh, begin, end, gradient)
        begin, end = regions.starts[r], regions.starts[r + 1]
        sums[r, 0] = value + add_ordered_springs(x, hh, elastic, regions, begin, end, gradient)
        sums[r, 1] = largest


def join_regions(x, h, constant, elastic, pinned, regions, gradient, sums):
    """Add the springs between regions; return g, |grad g| and the largest |x_i|."""
    hh = h * h
    value, largest = hh * constant, 0.0
    for r in range(len(sums)):
        value += sums[r, 0]
        largest = max(largest, sums[r, 1])
    begin, end = regions.starts[-1], len(regions.order)
    value += add_ordered_springs(x, hh, elastic, regions, begin, end, gradient)
    return value, zero_pins(pinned, gradient), math.sqrt(largest)


def add_ordered_springs(x, hh, elastic, regions, begin, end, gradient):
    """Add the gradient of springs begin to end - 1 of the order; return their part of g."""
    value, (rest_lengths, stiffnesses, tension_only) = 0.0, elastic
    for t in range(begin, end):
        i, j = at(regions.springs[at(t), 0]), at(regions.springs[at(t), 1])
        s = at(regions.order[at(t)])
        value += add_spring(
            x, i, j, hh * stiffnesses[s], rest_lengths[s], tension_only[s], gradient
        )
    return value


def add_particles(x, particles, hh, first, last, gradient):
    """Set the gradient of particles first to last - 1 to its terms other than springs.

    Return their part of g, and their largest squared distance from the origin.
    """
    value, largest, (y, external, masses) = 0.0, 0.0, particles
    for i in range(first, last):
        x_i, f = load_vector(x, i), scale(hh, load_vector(external, i))
        displacement = subtract(x_i, load_vector(y, i))
        inertia = scale(masses[i], displacement)
        store_vector(gradient, i, subtract(inertia, f))
        value += 0.5 * dot(inertia, displacement) - dot(f, x_i)
        largest = max(largest, dot(x_i, x_i))
    return value, largest


def add_spring(x, i, j, k, rest_length, tension_only, gradient):
    """Add the gradient of a spring, k being h² times its stiffness; return its part of g."""
    length, p, inverse = spring_line(x, i, j)
    stretch = spring_stretch(length, rest_length, tension_only)
    pull = scale(k * stretch * inverse, p)
    store_vector(gradient, i, add(load_vector(gradient, i), pull))
    store_vector(gradient, j, subtract(load_vector(gradient, j), pull))
    return 0.5 * k * stretch * stretch


def zero_pins(pinned, gradient):
    """Set the gradient at the pins to zero; return its norm."""
    squares = 0.0
    for p in pinned:
        store_vector(gradient, p, (0.0, 0.0, 0.0))
    for i in range(len(gradient)):
        squares += dot(load_vector(gradient, i), load_vector(gradient, i))
    return math.sqrt(squares)


def rounding_bounds(x, terms, workspace):
    """Return upper bounds of the rounding errors of |grad g| and of g.

    The workspace has shape (2, particle).
    """
    h, _, (y, external, masses), springs, elastic, pinned = terms
    size, reach = workspace[0], workspace[1]
    rest_lengths, stiffnesses, tension_only = elastic
    value_size, squares = 0.0, 0.0
    for i in range(len(x)):
        x_i, y_i, pull = (
            load_vector(x, i),
            load_vector(y, i),
            h * h * norm(load_vector(external, i)),
        )
        displacement = subtract(x_i, y_i)
        reach[i] = norm(x_i)
        size[i] = masses[i] * (reach[i] + norm(y_i)) + pull
        value_size += 0.5 * masses[i] * dot(displacement, displacement) + pull * reach[i]
    for s in range(len(springs)):
        i, j = springs[s, 0], springs[s, 1]
        length, _ = spring_frame(x, i, j)
        k, ends = h * h * stiffnesses[s], reach[i] + reach[j]
        stretch = abs(spring_stretch(length, rest_lengths[s], tension_only[s]))
        size[i] += k * (ends + rest_lengths[s])
        size[j] += k * (ends + rest_lengths[s])
        value_size += k * stretch * (stretch + ends)
    for p in pinned:
        size[p] = 0.0
    for i in range(len(x)):
        squares += size[i] * size[i]
    return SUM_ROUNDING * math.sqrt(squares), SUM_ROUNDING * value_size


def hessian_rounding(x, rest_lengths, terms, free, most_springs, sizes):
    """Return an upper bound of the rounding error of the Hessian at x, in norm [kg].

    The error includes that of the effective rest lengths, relative to these and the given ones.
    `sizes` is workspace, (particle,).
    """
    h, _, (_, _, masses), springs, (effective, stiffnesses, tension_only), _ = terms
    largest = 0.0
    for i in range(len(sizes)):
        sizes[i] = masses[i]
    for s in range(len(springs)):
        i, j, k = springs[s, 0], springs[s, 1], h * h * stiffnesses[s]
        length, _ = spring_frame(x, i, j)
        rest, share = rest_lengths[s] + effective[s], 0.0
        if rest > 0.0 and not (tension_only[s] and length < effective[s]):
            share = rest / max(length, TINY)
        sizes[i] += 2.0 * k * (1.0 + share)
        sizes[j] += 2.0 * k * (1.0 + share)
    for i in range(len(sizes)):
        if free[i]:
            largest = max(largest, sizes[i])
    return (HESSIAN_ROUNDING + most_springs) * EPS * largest


def rounding_coefficients(y, external, h, masses, spring_sums, free):
    """Return a, b such that a + b r bounds the rounding error of |grad g| when all |x_i| <= r.

    The bound is `rounding_bounds` with r for every |x_i|, by the triangle inequality.
    """
    a, b = 0.0, 0.0
    for i in range(len(y)):
        if free[i]:
            pull = norm(load_vector(external, i)) + spring_sums[i, 0]
            constant = masses[i] * norm(load_vector(y, i)) + h * h * pull
            slope = masses[i] + h * h * spring_sums[i, 1]
            a += constant * constant
            b += slope * slope
    return MARGIN * SUM_ROUNDING * math.sqrt(a), MARGIN * SUM_ROUNDING * math.sqrt(b)
