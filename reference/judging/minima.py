"""The known minimisers of a step, against the nearest of which an answer is measured.

Where springs are compressed g may have several minimisers, each of which is an end of the step. An
answer x is measured against two: the limit of Newton's method from y, and its limit from x. The
second limit counts only if it is proven to be a minimiser: an answer far from all stays far.
"""

import copy
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST_COORDINATE, SMALLEST_POSITIVE, FloatArray
from ..implicit_euler import STEP_SOLVERS, ImplicitEuler
from ..implicit_euler.certificate import Certificate, certify
from ..mass_spring import MassSpring, State

# The smallest tolerance: only rounding stops Newton's method.
TOLERANCE = SMALLEST_POSITIVE
# Five times Newton's default: without an end by then Newton's method has no limit.
MAX_ITERATIONS = 500


@dataclass(frozen=True, eq=False)
class Minimum:
    """A limit of Newton's method: positions, shape (particle, 3) [m], g [kg m²], the proof."""

    positions: FloatArray
    value: float
    certificate: Certificate

    def distance(self, x: FloatArray) -> float:
        """Return the distance of positions over all coordinates [m]."""
        return float(np.linalg.norm(x - self.positions))


class Minima:
    """The known minimisers of a step.

    Attributes:
        objective: g of the step.
        solution: the result of Newton's method from y.
        newton: the end of Newton's method from y, a minimum if the solution is solved.
        known: the minima known so far.
    """

    def __init__(
        self,
        system: MassSpring,
        state: State,
        h: float,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> None:
        """Run Newton's method from y; arguments and errors are as for `ImplicitEuler.step`."""
        integrator = ImplicitEuler(system, h=h, tolerance=TOLERANCE, max_iterations=MAX_ITERATIONS)
        self.objective = integrator.objective(state, external_forces, pin_positions)
        self.solution = integrator.step(state, external_forces, pin_positions)
        self.newton = self._minimum(self.solution.state.positions)
        self.known = [self.newton] if self.solution.outcome.solved else []

    def nearest(self, x: FloatArray) -> Minimum:
        """Return the nearer to x of Newton's limits from y and, if proven, from x.

        Earlier calls for other answers do not change the result.
        """
        limit = self._limit(x) or self.newton
        newton = self.newton if self.solution.outcome.solved else limit
        return min(newton, limit, key=lambda minimum: minimum.distance(x))

    @property
    def lowest(self) -> Minimum:
        """The known minimum with the least g."""
        return min(self.known or [self.newton], key=lambda minimum: minimum.value)

    def excess(self, x: FloatArray, base: Minimum) -> float:
        """Return (g(x) - g*) / (g(y) - g*) with g* at the base, infinity if none is known."""
        if not self.known:
            return math.inf
        height = self.objective.inertial.value - base.value
        above = self.objective.iterate_at(x).value - base.value
        return above / height if height > 0.0 else 0.0 if above <= 0.0 else math.inf

    def _limit(self, x: FloatArray) -> Minimum | None:
        """Return the minimum that Newton's method finds from x, None without a proven one."""
        end = self._newton_from(np.where(self.objective.system.free[:, None], x, self.objective.y))
        if end is None:
            return None
        for minimum in self.known:
            if minimum.distance(end) <= minimum.certificate.unique_within:
                return minimum
        limit = self._minimum(end)
        if not limit.certificate.covered:
            return None
        self.known.append(limit)
        return limit

    @np.errstate(over="ignore", invalid="ignore")
    def _newton_from(self, x: FloatArray) -> FloatArray | None:
        """Return the last iterate of Newton's method from x, None if it leaves the numbers."""
        objective = copy.copy(self.objective)
        objective.start = last = objective.iterate_at(x)
        newton = STEP_SOLVERS["newton"](objective.system, objective.h)
        for count, iterate in enumerate(newton.iterates(objective)):
            if not (iterate.finite and np.abs(iterate.positions).max() <= LARGEST_COORDINATE):
                return None
            is_rounding = iterate.at_floor and iterate.gradient_norm >= last.gradient_norm
            if count and (is_rounding or iterate is last or count == MAX_ITERATIONS):
                break
            last = iterate
        return last.positions

    def _minimum(self, x: FloatArray) -> Minimum:
        return Minimum(x, self.objective.iterate_at(x).value, certify(self.objective, x))
