"""Divide a large system into regions of particles, so that threads can sum its springs.

A region is a run of particles by number, and has the springs whose two ends both lie in it. What is
summed over one touches no other. Springs between regions come last, one after the other: they are
few where neighbours have numbers near each other, as in cloths and lattices. The regions depend on
the system only, so that results are the same bits on any number of cores.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import IndexArray

# The fewest springs for which a second thread is worth while.
LARGE = 1_000_000
REGIONS = 32


class Regions(NamedTuple):
    """The regions of a system.

    Attributes:
        particles: the first particle of each, and the number of particles, (region + 1,).
        order: the springs, region after region, those between regions last, (spring,).
        springs: the two particles of each in that order, (spring, 2).
        starts: where the springs of each begin in `order`, and then those between, (region + 1,).
    """

    particles: IndexArray
    order: np.ndarray
    springs: np.ndarray
    starts: IndexArray


def cut(springs: IndexArray, particles: int, count: int = REGIONS) -> Regions:
    """Return so many regions of a system whose springs, (spring, 2), join these particles."""
    bounds = np.arange(count + 1) * particles // count
    first, second = np.searchsorted(bounds, springs, side="right").T - 1
    region = np.where(first == second, first, count)
    order = np.argsort(region, kind="stable").astype(np.int32)
    ordered = springs[order].astype(np.int32)
    return Regions(bounds, order, ordered, np.searchsorted(region[order], np.arange(count + 1)))
