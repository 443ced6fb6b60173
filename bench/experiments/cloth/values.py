"""The records of the lab's cloth: residuals and errors of steps, and two laws of dampers."""

from ...harness.values import Floats1, Values
from . import DAMPERS, FEW, ONE_STEP


class StepWords(Values, frozen=True, kw_only=True):
    """The number of iterations of a step, where fixed."""

    iterations: int = 0


class IterationErrors(StepWords, frozen=True):
    """Residual and error of a step at the start and after each iteration, (iteration + 1,)."""

    residual: Floats1
    error: Floats1


class TruncatedSteps(StepWords, frozen=True):
    """Steps of a few iterations compared with converged steps, (step,): relative error, and [m]."""

    error: Floats1
    distance: Floats1
    drift: Floats1
    path: Floats1


class DamperDifferences(Values, frozen=True):
    """Relative difference between the forces of two laws of dampers in steps of h [s]."""

    h: Floats1
    difference: Floats1


KINDS = {ONE_STEP: IterationErrors, FEW: TruncatedSteps, DAMPERS: DamperDifferences}
