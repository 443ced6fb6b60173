"""Local/global iterations: each updates the springs' directions, then all positions at once.

Liu, Bargteil, O'Brien, Kavan 2013, "Fast Simulation of Mass-Spring Systems". The local step finds
the optimal d for the current x; the global step minimises g for constant d, so g never grows:

    x_next = (M + h² L)^-1 (h² J d + M y + h² f_ext) = x - (M + h² L)^-1 grad g(x).

Chebyshev's semi-iterative method accelerates these iterations (Wang 2015), with x_k, x_k-1 and a
local/global step s:

    x_k+1 = w_k+1 (c s + x_k - x_k-1) + x_k-1,    w_1 = 1, w_2 = 2 / (2 - R²),
                                                  w_k+1 = 4 / (4 - R² w_k).

The relaxation c = 1 + R and the estimate of R from the decay of the steps are derived in
docs/implicit_euler.md.
"""

import math
from collections.abc import Iterator

import numpy as np

from .factor_cache import GlobalMatrixSolver
from .objective import Iterate, Objective

PLAIN = 5  # iterations before the acceleration begins
TRIAL = 5  # least number of accelerated iterations between two estimates of R
TOLERATED_POWER = 0.65  # R is estimated again if steps shrink by less than this power of the theory
LARGEST = 0.99999  # R
LARGEST_EXPONENT = 300.0  # of the expected reduction, so that no number overflows


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


class Chebyshev(GlobalMatrixSolver):
    """Accelerated local/global iterations."""

    default_iterations = 1000

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start, then the iterate after each iteration."""
        before = iterate = objective.start
        acceleration = Acceleration()
        while True:
            yield iterate
            x, step = iterate.positions, -self._factor.solve(iterate.gradient)
            size = math.sqrt(abs(np.sum(step * iterate.gradient)))
            weight, relaxation = acceleration.next(size)
            displacement = (weight - 1) * (x - before.positions) + (weight * relaxation) * step
            after = objective.iterate_at(x + displacement)
            if after.is_above(iterate):
                after = objective.iterate_at(x + step)
                acceleration.restart()
            before, iterate = iterate, after


class Acceleration:
    """The weights w and the relaxation c, from the sizes sqrt(s' (M + h² L) s) of plain steps s."""

    def __init__(self) -> None:
        """Start with plain iterations."""
        self._R, self._plain, self._last = 0.0, 0, 0.0
        self.restart()

    def restart(self) -> None:
        """Start the sequence of weights again with the current R."""
        self._count, self._weight = 0, 1.0

    def next(self, size: float) -> tuple[float, float]:
        """Return w and c of the next iteration from the size of its plain step."""
        if self._plain < PLAIN:
            self._plain += 1
        elif self._R == 0.0:
            rho = min(size / self._last, LARGEST) if self._last > 0 else 0.0
            self._R = rho / (2 - rho)
            self.restart()
        elif self._count >= TRIAL:
            self._correct_estimate(size)
        if self._count == 0:
            self._first = size
        elif self._count == 1:
            self._weight = 2 / (2 - self._R**2)
        else:
            self._weight = 4 / (4 - self._R**2 * self._weight)
        self._count, self._last = self._count + 1, size
        return self._weight, 1 + self._R

    def _correct_estimate(self, size: float) -> None:
        expected = 1 / math.cosh(min(self._count * math.acosh(1 / self._R), LARGEST_EXPONENT))
        if size > expected**TOLERATED_POWER * self._first > 0:
            excess = math.acosh(max(size / (expected * self._first), 1.0)) / self._count
            self._R = min(self._R * math.cosh(excess), LARGEST)
            self.restart()
