"""Orders of convergence in h, towards an accurate solution and between two integrators."""

from collections.abc import Sequence

import numpy as np

from plumbob.reference.arguments import FloatArray

from .. import samples
from ..verdict import Comparison
from .integrators import SIMULATORS

# Steps of the coarser of two runs, and the refinement of the accurate solution, of order 4.
STEPS = 40
REFINEMENT = 8


def orders_to_the_limit(names: Sequence[str], order: int, truth: str, case: int) -> Comparison:
    """Compare the orders of convergence to an accurate solution with the expected one."""
    limit = end(case, truth, REFINEMENT)
    runs = [(end(case, name, 1) - limit, end(case, name, 2) - limit) for name in names]
    return _orders(runs, order)


def orders_to_each_other(name: str, other: str, order: int, case: int) -> Comparison:
    """Compare the order of the difference between two integrators with the expected one."""
    differences = [end(case, name, k) - end(case, other, k) for k in (1, 2)]
    return _orders([differences], order)


def end(case: int, name: str, refinement: int) -> FloatArray:
    """Return the final positions of a smooth problem, its h divided by the refinement."""
    system, state, external, h = samples.smooth(case)
    simulate = SIMULATORS[name](system, h / refinement)
    return simulate(state, external, STEPS * refinement).positions


def observed_order(coarse: FloatArray, refined: FloatArray) -> float:
    """Return the order of convergence from the errors for h and for h/2."""
    return float(np.log2(np.linalg.norm(coarse) / np.linalg.norm(refined)))


def _orders(runs: Sequence[Sequence[FloatArray]], order: int) -> Comparison:
    observed = np.array([observed_order(*errors) for errors in runs])
    expected = np.full_like(observed, order)
    return Comparison(observed, expected, np.zeros_like(observed), scale=1.0)
