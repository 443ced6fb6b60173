"""The minima of a step to 25 digits, against the nearest of which answers are measured.

All answers of a solver, as after more and more iterations, are measured against the known minimum
nearest to the last of them; `Minima` says which minima are known of an answer.
"""

import functools
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from plumbob.crosscheck.mass_spring.exact_step import exact_step
from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import LARGEST_COORDINATE, FloatArray
from plumbob.reference.judging.minima import Minima

# An excess of g below this value is rounding: g is rounded to 1e-16, and y up to some 1,000 times
# less above a minimum.
ROUNDING = 1e-12


class StepErrors(NamedTuple):
    """Errors of answers, (answer,), beside a minimum x*; infinite after divergence.

    Excesses of g are above the limit x_N of Newton's method from y, over the same of y.
    """

    error: FloatArray  # |x − x*| / |y − x*|
    above: FloatArray  # (g(x) − g(x_N)) / (g(y) − g(x_N))
    minimum: float  # the same of x*, 0 of x_N
    proven: bool  # whether x* is proven to be a minimum


class StepMinima(Minima):
    """The known minima of a step; an ArithmeticError if Newton's method does not converge."""

    def __init__(self, system: MassSpring, state: State, h: float) -> None:
        """Find the limit x_N of Newton's method from y."""
        super().__init__(system, state, h)
        if not self.solution.outcome.solved:
            raise ArithmeticError(f"Newton ended the step as {self.solution.outcome.name}")
        self.exact = functools.cache(lambda end: exact_step(system, state, h, end.positions))

    @property
    def rounding(self) -> float:
        """The error of x_N rounded to single precision."""
        rounded = self.newton.positions.astype(np.float32).astype(float)
        return self.exact(self.newton).error(rounded, self.objective.y)

    def measure(self, answers: Sequence[FloatArray]) -> StepErrors:
        """Measure the answers of a solver, each (particle, 3) [m], the most accurate last."""
        finite = [bool(np.abs(x).max() <= LARGEST_COORDINATE) for x in answers]
        known = list(itertools.compress(answers, finite))
        minimum = self.nearest(known[-1]) if known else self.newton
        exact, y = self.exact(minimum), self.objective.y
        error, above = np.full((2, len(answers)), np.inf)
        error[finite] = [exact.error(x, y) for x in known]
        above[finite] = [self.excess(x, self.newton) for x in known]
        height = self.excess(minimum.positions, self.newton)
        return StepErrors(error, above, height, minimum.certificate.covered)


minima_of = functools.cache(StepMinima)


def above_lowest(values: ArrayLike, minima: Sequence[float]) -> FloatArray:
    """Return excesses of g relative to the lowest of several minima and Newton's, rounding as 0.

    Values and minima are excesses relative to Newton's, as in `StepErrors`.
    """
    lowest = min(0.0, *minima)
    excess = (np.asarray(values) - lowest) / (1.0 - lowest)
    return np.where(excess < ROUNDING, 0.0, excess)
