"""The minima of a step to 25 digits, against the nearest of which answers are measured.

All answers of a solver, as after more and more iterations, are measured against the known minimum
nearest to the last of them; `Minima` says which minima are known of an answer.
"""

import functools
import itertools
from collections.abc import Sequence

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import exact_step
from plumbob.reference import MassSpring, State
from plumbob.reference.arguments import LARGEST_COORDINATE, FloatArray
from plumbob.reference.judging.minima import Minima

# Smaller shares of the fall of g are rounding: g, rounded by 1e-16 of itself, falls by over 1e-3.
ROUNDING = 1e-12


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

    def measure(self, answers: Sequence[FloatArray]) -> dict[str, FloatArray]:
        """Return errors of a solver's answers, each (particle, 3) [m], the most accurate last.

        The arrays (answer,) are "error", |x − x*| / |y − x*|, infinite after divergence; "above",
        (g(x) − g(x_N)) / (g(y) − g(x_N)); "minimum", the same of x*; and whether x* is "proven".
        """
        finite = [bool(np.abs(x).max() <= LARGEST_COORDINATE) for x in answers]
        known = list(itertools.compress(answers, finite))
        minimum = self.nearest(known[-1]) if known else self.newton
        exact, y = self.exact(minimum), self.objective.y
        error, above = np.full((2, len(answers)), np.inf)
        error[finite] = [exact.error(x, y) for x in known]
        above[finite] = [self.excess(x, self.newton) for x in known]
        above[np.abs(above) < ROUNDING] = 0.0
        height = np.full(len(answers), self.excess(minimum.positions, self.newton))
        proven = np.full(len(answers), minimum.certificate.covered)
        return {"error": error, "above": above, "minimum": height, "proven": proven}


minima_of = functools.cache(StepMinima)


def above_lowest(value: float, minima: Sequence[float]) -> float:
    """Return g above the lowest of minima and Newton's, for g as `StepMinima.measure` has it."""
    lowest = min(0.0, *minima)
    above = (value - lowest) / (1.0 - lowest)
    return 0.0 if above < ROUNDING else above
