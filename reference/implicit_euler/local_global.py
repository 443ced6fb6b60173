"""Local/global iterations: each updates the springs' directions, then all positions at once.

Liu, Bargteil, O'Brien, Kavan 2013, "Fast Simulation of Mass-Spring Systems". The local step finds
the optimal d for the current x; the global step minimises g for constant d, so that g never grows:

    (M + h² L) x_next = h² J d + M y + h² f_ext.

Since grad g(x) = (M + h² L) x - (h² J d + M y + h² f_ext) for the optimal d, the same step is

    x_next = x - (M + h² L)^-1 grad g(x),

which is accurate for small corrections and does not move the pins. The lab's version is one
iteration.
"""

from collections.abc import Iterator

import numpy as np

from .factor_cache import GlobalMatrixSolver
from .objective import Iterate, Objective


class LocalGlobal(GlobalMatrixSolver):
    """Local/global iterations."""

    default_iterations = 1000

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        iterate = objective.start
        while True:
            yield iterate
            x = self._factor.solve(iterate.gradient)
            iterate = objective.iterate_at(np.subtract(iterate.positions, x, out=x))
