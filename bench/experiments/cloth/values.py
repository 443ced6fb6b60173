"""The records of the lab's cloth: residuals and errors of steps, and two laws of dampers."""

import msgspec

from ...harness.values import Details, Floats1, Kind, Values
from . import DAMPERS, FEW, ONE_STEP


class IterationErrors(Values, frozen=True):
    """Residual and error of a step at the start and after each iteration, (iteration + 1,)."""

    residual: Floats1
    error: Floats1


class TruncatedSteps(Values, frozen=True):
    """Steps of a few iterations compared with converged steps, (step,): relative error, and [m]."""

    error: Floats1
    distance: Floats1
    drift: Floats1
    path: Floats1


class DamperDifferences(Values, frozen=True):
    """Relative difference between the forces of two laws of dampers in steps of h [s]."""

    h: Floats1
    difference: Floats1 = msgspec.field(name="apart")


class StepDetails(Details, frozen=True):
    """The number of iterations of a step, where fixed."""

    iterations: int = 0


KINDS = {
    ONE_STEP: Kind(IterationErrors, StepDetails),
    FEW: Kind(TruncatedSteps, StepDetails),
    DAMPERS: Kind(DamperDifferences),
}
