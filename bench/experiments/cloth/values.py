"""The records of the lab's cloth: residuals and errors of steps, and two laws of dampers."""

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import DAMPERS, FEW, ONE_STEP, SWING


class Converged(Values, frozen=True):
    """Consecutive converged steps, (step,): an outcome is the number of an `Outcome`."""

    iterations: Integers1
    residual: Floats1
    outcome: Integers1
    at_floor: Booleans1


class Iterated(Values, frozen=True):
    """Residual and error of one step, at first and after each iteration, (iteration + 1,)."""

    residual: Floats1
    error: Floats1


class FewIterations(Values, frozen=True):
    """Steps of a few iterations beside converged ones, (step,), in metres but for the error."""

    error: Floats1
    distance: Floats1
    drift: Floats1
    path: Floats1


class Dampers(Values, frozen=True):
    """How far the forces of two laws of dampers differ, relatively, in steps of h [s]."""

    h: Floats1
    apart: Floats1


class StepDetails(Details, frozen=True):
    """The length of a step [s], and how many iterations it makes, where that is fixed."""

    h: float
    iterations: int = 0


class DamperDetails(Details, frozen=True):
    """The damping of every spring [N s/m], and after how many steps the laws are compared."""

    damping: float
    first: int


KINDS = {
    SWING: Kind(Converged, StepDetails),
    ONE_STEP: Kind(Iterated, StepDetails),
    FEW: Kind(FewIterations, StepDetails),
    DAMPERS: Kind(Dampers, DamperDetails),
}
