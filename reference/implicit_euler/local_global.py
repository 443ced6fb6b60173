"""Local/global iterations: the springs' directions, then one linear solve for all positions.

Liu, Bargteil, O'Brien, Kavan 2013, "Fast Simulation of Mass-Spring Systems". The local step fits d
to the current x; the global step minimises g with that d held, so that g never grows:

    (M + h² L) x_next = h² J d + M y + h² f_ext.

Since grad g(x) = (M + h² L) x - (h² J d + M y + h² f_ext) for the d that fits x, the same step is

    x_next = x - (M + h² L)^-1 grad g(x),

which needs no second right-hand side, keeps every digit of a small correction and leaves the pins
alone. One iteration is the lab's version.
"""

from collections.abc import Iterator

import numpy as np

from ..mass_spring import MassSpring
from .factor_cache import global_factor
from .objective import Iterate, Objective


class LocalGlobal:
    """Local/global iterations; M + h² L is factorised here, once for all steps."""

    default_iterations = 1000

    def __init__(self, system: MassSpring, h: float) -> None:
        """Factorise M + h² L.

        Raises:
            NotPositiveDefiniteError: if it is singular to rounding, masses being too small.
        """
        self._factor = global_factor(system, h)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start and then one iterate after the other, without end."""
        iterate = objective.start
        while True:
            yield iterate
            x = self._factor.solve(iterate.gradient)
            iterate = objective._evaluate(np.subtract(iterate.positions, x, out=x))
