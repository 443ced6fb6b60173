"""Divide a large system into regions of particles, for threads to sum its springs.

A region is a run of particles by number with the springs between them; threads sum over regions
independently. Springs between regions come last, in a single thread. Such springs are few where
neighbours have numbers near each other, as in cloths and lattices. The regions depend on the system
only: results are the same bits on any number of cores.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import IndexArray

# The fewest springs for which a second thread is worth while.
LARGE = 1_000_000
# The same for any number of cores, for the same bits; up to as many cores find work.
REGIONS = 32


class Regions(NamedTuple):
    """The regions of a system."""

    particles: IndexArray  # the first particle of each, and the number of particles, (region + 1,)
    order: np.ndarray  # the springs, region after region, then the springs between, (spring,)
    springs: np.ndarray  # the two particles of each in that order, (spring, 2)
    starts: IndexArray  # where the springs of each, then the springs between, begin, (region + 1,)


def partition_springs(springs: IndexArray, particles: int, count: int = REGIONS) -> Regions:
    """Divide a system with springs (spring, 2) into regions."""
    bounds = np.arange(count + 1) * particles // count
    first, second = np.searchsorted(bounds, springs, side="right").T - 1
    region = np.where(first == second, first, count)
    order = np.argsort(region, kind="stable").astype(np.int32)
    ordered = springs[order].astype(np.int32)
    return Regions(bounds, order, ordered, np.searchsorted(region[order], np.arange(count + 1)))
