"""Local/global iterations, accelerated.

Wang 2015, "A Chebyshev Semi-Iterative Approach for Accelerating Projective and Position-based
Dynamics", takes from an iterate x_k, the one before it and a local/global step s the next as

    x_k+1 = w_k+1 (c s + x_k - x_k-1) + x_k-1,    w_1 = 1, w_2 = 2 / (2 - R²),
                                                  w_k+1 = 4 / (4 - R² w_k),

after some plain ones, since the springs' directions turn most in the beginning. Near the solution
an iteration multiplies errors by numbers from 0 to rho < 1, because M + h² L is above the Hessian
of g. With c = 1 + R and R = rho / (2 - rho) the relaxed steps multiply them by -R to R, which is
what the weights are made for; Wang has c = 1 and R = rho, for numbers from -rho to rho.

No rho has to be given. It begins as the last ratio of two plain steps and is measured again by how
steps shrink: k accelerated iterations should shrink them by 1 / cosh(k arcosh(1/R)), and if they
shrink by B times that only, R times cosh(arcosh(B) / k) was there (Hageman and Young 1981,
"Applied Iterative Methods", section 5.4).

Far from the solution all this is hope: wherever g would grow, a plain iteration, by which it never
does, takes the place of the accelerated one.
"""

import math
from collections.abc import Iterator

import numpy as np

from ..mass_spring import MassSpring
from .factor_cache import global_factor
from .objective import Iterate, Objective

PLAIN = 5  # iterations before the acceleration begins
TRIAL = 5  # accelerated iterations at least before R is doubted
PATIENCE = 0.65  # R is doubted where steps shrink by less than this power of what they should
LARGEST = 0.99999  # R
FARTHEST = 300.0  # exponent of what steps may be hoped to shrink by: no number overflows


class Chebyshev:
    """Accelerated local/global iterations; M + h² L is factorised here, for all steps."""

    default_iterations = 1000

    def __init__(self, system: MassSpring, h: float) -> None:
        """Factorise M + h² L.

        Raises:
            NotPositiveDefiniteError: if it is singular to rounding, masses being too small.
        """
        self._factor = global_factor(system, h)

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the objective's start and then one iterate after the other, without end."""
        before = iterate = objective.start
        pace = Pace()
        while True:
            yield iterate
            x, step = iterate.positions, -self._factor.solve(iterate.gradient)
            weight, relaxation = pace.next(math.sqrt(abs(np.sum(step * iterate.gradient))))
            way = (weight - 1) * (x - before.positions) + (weight * relaxation) * step
            after = objective._evaluate(x + way)
            if after.is_above(iterate):
                after = objective._evaluate(x + step)
                pace.restart()
            before, iterate = iterate, after


class Pace:
    """The weights w and the relaxation c, from how the plain steps shrink.

    A step s has the size sqrt(s' (M + h² L) s), in which iterations multiply errors as said above.
    """

    def __init__(self) -> None:
        """Begin with plain iterations."""
        self._R, self._plain, self._last = 0.0, 0, 0.0
        self.restart()

    def restart(self) -> None:
        """Let the next iteration be the first of those that are accelerated with this R."""
        self._count, self._weight = 0, 1.0

    def next(self, size: float) -> tuple[float, float]:
        """Return w and c of the next iteration, before which the plain step has this size."""
        if self._plain < PLAIN:
            self._plain += 1
        elif self._R == 0.0:
            self._begin(size)
        elif self._count >= TRIAL:
            self._doubt(size)
        if self._count == 0:
            self._first = size
        elif self._count == 1:
            self._weight = 2 / (2 - self._R**2)
        else:
            self._weight = 4 / (4 - self._R**2 * self._weight)
        self._count, self._last = self._count + 1, size
        return self._weight, 1 + self._R

    def _begin(self, size: float) -> None:
        rho = min(size / self._last, LARGEST) if self._last > 0 else 0.0
        self._R = rho / (2 - rho)
        self.restart()

    def _doubt(self, size: float) -> None:
        share = 1 / math.cosh(min(self._count * math.acosh(1 / self._R), FARTHEST))
        if size > share**PATIENCE * self._first > 0:
            short = math.acosh(max(size / (share * self._first), 1.0)) / self._count
            self._R = min(self._R * math.cosh(short), LARGEST)
            self.restart()
