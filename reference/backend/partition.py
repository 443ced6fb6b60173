"""A large system cut into regions of particles, so that its springs can be summed side by side.

A region is a run of particles by number, and has the springs whose two ends both lie in it. What is
summed over one touches no other. Springs between regions come last, one after the other: few where
neighbours have numbers near each other, as in cloths and lattices; otherwise nothing is lost but
the gain. The cut depends on the system alone, so that results are the same bits on any number of
cores.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import IndexArray

# A system with fewer springs is summed sooner than another thread begins.
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
