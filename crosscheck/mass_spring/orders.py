"""Convergence: at what order of h motions come to one limit, and two of them to each other."""

from collections.abc import Iterator, Sequence

import numpy as np

from reference.arguments import FloatArray

from .. import samples
from ..verdict import Comparison
from .motions import MOTIONS

# The coarser of two runs takes so many steps of a smooth motion's h, and the truth, which is of
# order 4, so many times as many.
STEPS = 40
TRUTH = 8


def orders_to_the_limit(
    names: Sequence[str], order: int, truth: str, cases: int
) -> Iterator[Comparison]:
    """Compare the orders at which motions come to the truth with the one expected."""
    for case in range(cases):
        limit = end(case, truth, TRUTH)
        runs = [(end(case, name, 1) - limit, end(case, name, 2) - limit) for name in names]
        yield _orders(runs, order)


def orders_to_each_other(name: str, other: str, order: int, cases: int) -> Iterator[Comparison]:
    """Compare the order at which two motions come to each other with the one expected."""
    for case in range(cases):
        apart = [end(case, name, halved) - end(case, other, halved) for halved in (1, 2)]
        yield _orders([apart], order)


def end(case: int, name: str, refinement: int) -> FloatArray:
    """Return the positions at the end of a smooth motion, its h divided by the refinement."""
    system, state, external, h = samples.smooth(case)
    motion = MOTIONS[name](system, h / refinement)
    return motion(state, external, STEPS * refinement).positions


def observed_order(coarse: FloatArray, fine: FloatArray) -> float:
    """Return the order of an error that halving h has brought from coarse to fine."""
    return float(np.log2(np.linalg.norm(coarse) / np.linalg.norm(fine)))


def _orders(runs: Sequence[Sequence[FloatArray]], order: int) -> Comparison:
    observed = np.array([observed_order(coarse, fine) for coarse, fine in runs])
    expected = np.full_like(observed, order)
    return Comparison(observed, expected, np.zeros_like(observed), scale=1.0)
