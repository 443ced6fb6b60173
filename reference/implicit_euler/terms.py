"""The terms of g, summed by kernels: its value and gradient, its dampers, and what rounding does.

What every kernel here is given is in SI units; see `objective` for the definition of g.
"""

import math

import numpy as np
from numpy import uint64 as at

from ..quaternion import add, dot, load_vector, norm, scale, store_vector, subtract
from ..springs import spring_frame, spring_stretch

# Rounding errors in the gradient are a few units in the last place of the terms that it sums.
EPS = float(np.finfo(float).eps)
SUM_ROUNDING = 64 * EPS
# What is said to be no less than the floor is rounded itself.
MARGIN = 1.000001


def blend_dampers(x_n, h, stiffnesses, system):
    """Return the effective rest lengths, and the constant that completes the square.

    k/2 (l - a)² + b/2 (l - e)² = (k + b)/2 (l - rest)² + k b / (k + b) / 2 (a - e)².
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


def evaluate_objective(
    x, y, external, h, constant, masses, springs, rest_lengths, stiffnesses, tension_only, pinned
):
    """Return grad g, g, |grad g| and the farthest that a particle is from the origin."""
    gradient, hh = np.empty(x.shape), h * h
    value, farthest = add_particles(x, y, external, hh, masses, 0, len(x), gradient)
    value += hh * constant
    for s in range(len(springs)):
        i, j, k = at(springs[s, 0]), at(springs[s, 1]), hh * stiffnesses[s]
        value += add_spring(x, i, j, k, rest_lengths[s], tension_only[s], gradient)
    return gradient, value, settle(pinned, gradient), math.sqrt(farthest)


def evaluate_regions(
    x, y, external, h, masses, rest_lengths, stiffnesses, tension_only, regions, first, last,
    gradient, sums,
):  # fmt: skip
    """Do the part of `evaluate_objective` that lies within some regions.

    Each region's share of g and farthest squared distance from the origin go into `sums`, (region,
    2).
    """
    hh, elastic = h * h, (rest_lengths, stiffnesses, tension_only)
    for r in range(first, last):
        begin, end = regions.particles[r], regions.particles[r + 1]
        value, farthest = add_particles(x, y, external, hh, masses, begin, end, gradient)
        begin, end = regions.starts[r], regions.starts[r + 1]
        sums[r, 0] = value + add_ordered(x, hh, elastic, regions, begin, end, gradient)
        sums[r, 1] = farthest


def join_regions(
    x, h, constant, rest_lengths, stiffnesses, tension_only, pinned, regions, gradient, sums
):
    """Add the springs between regions; return g, |grad g| and the farthest distance."""
    hh, elastic = h * h, (rest_lengths, stiffnesses, tension_only)
    value, farthest = hh * constant, 0.0
    for r in range(len(sums)):
        value += sums[r, 0]
        farthest = max(farthest, sums[r, 1])
    begin, end = regions.starts[-1], len(regions.order)
    value += add_ordered(x, hh, elastic, regions, begin, end, gradient)
    return value, settle(pinned, gradient), math.sqrt(farthest)


def add_ordered(x, hh, elastic, regions, begin, end, gradient):
    """Add h² times the gradient of a run of springs in the order of regions; return their g."""
    value, (rest_lengths, stiffnesses, tension_only) = 0.0, elastic
    for t in range(begin, end):
        i, j = at(regions.springs[at(t), 0]), at(regions.springs[at(t), 1])
        s = at(regions.order[at(t)])
        value += add_spring(
            x, i, j, hh * stiffnesses[s], rest_lengths[s], tension_only[s], gradient
        )
    return value


def add_particles(x, y, external, hh, masses, first, last, gradient):
    """Fill the gradient of some particles without springs.

    Return their share of g, and the farthest squared distance from the origin.
    """
    value, farthest = 0.0, 0.0
    for i in range(first, last):
        x_i, f = load_vector(x, i), scale(hh, load_vector(external, i))
        away = subtract(x_i, load_vector(y, i))
        inertia = scale(masses[i], away)
        store_vector(gradient, i, subtract(inertia, f))
        value += 0.5 * dot(inertia, away) - dot(f, x_i)
        farthest = max(farthest, dot(x_i, x_i))
    return value, farthest


def add_spring(x, i, j, k, rest_length, tension_only, gradient):
    """Add the gradient of a spring of stiffness k, h² and all; return its share of g."""
    length, u = spring_frame(x, i, j)
    stretch = spring_stretch(length, rest_length, tension_only)
    pull = scale(k * stretch, u)
    store_vector(gradient, i, add(load_vector(gradient, i), pull))
    store_vector(gradient, j, subtract(load_vector(gradient, j), pull))
    return 0.5 * k * stretch * stretch


def settle(pinned, gradient):
    """Set the gradient of the pins to zero; return its norm."""
    squares = 0.0
    for p in pinned:
        store_vector(gradient, p, (0.0, 0.0, 0.0))
    for i in range(len(gradient)):
        squares += dot(load_vector(gradient, i), load_vector(gradient, i))
    return math.sqrt(squares)


def measure_rounding(
    x, y, external, h, masses, springs, rest_lengths, stiffnesses, tension_only, pinned
):
    """Return what rounding can leave of |grad g| and move of g."""
    size, reach, value_size, squares = np.empty(len(x)), np.empty(len(x)), 0.0, 0.0
    for i in range(len(x)):
        x_i, y_i, pull = (
            load_vector(x, i),
            load_vector(y, i),
            h * h * norm(load_vector(external, i)),
        )
        away = subtract(x_i, y_i)
        reach[i] = norm(x_i)
        size[i] = masses[i] * (reach[i] + norm(y_i)) + pull
        value_size += 0.5 * masses[i] * dot(away, away) + pull * reach[i]
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


def most_rounding(y, external, h, masses, spring_sums, free):
    """Return a and b: wherever no particle is farther than r from the origin, a + b r is no less.

    No less, that is, than what rounding can leave of |grad g|: its terms are summed with r for
    every |x_i|, and the norm of a sum is at most the sum of norms.
    """
    a, b = 0.0, 0.0
    for i in range(len(y)):
        if free[i]:
            pull = norm(load_vector(external, i)) + spring_sums[i, 0]
            still = masses[i] * norm(load_vector(y, i)) + h * h * pull
            moving = masses[i] + h * h * spring_sums[i, 1]
            a += still * still
            b += moving * moving
    return MARGIN * SUM_ROUNDING * math.sqrt(a), MARGIN * SUM_ROUNDING * math.sqrt(b)
