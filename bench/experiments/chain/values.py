"""The records of a chain that reaches for targets."""

import math

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import CHAIN


class Reached(Values, frozen=True):
    """The answers to a batch of targets, (target,).

    Attributes:
        residual: distance from the target, infinite without an answer [m].
        solved: whether it is within the tolerance.
        iterations: NaN where the solver does not say them.
        distance: of the target from the root [m].
        bend: how far the joints are off the line from root to target [m].
        excess: residual above distance - reach [m].
        reach: of the chain [m].
        outcome: the number of an `Outcome`, of our solvers.
        history_low: the 10th percentile of the residuals by iteration, (iteration + 1,) [m].
        history_median: their median.
        history_high: their 90th percentile.
        seconds: for a target by itself.
    """

    residual: Floats1
    solved: Booleans1
    iterations: Floats1
    distance: Floats1
    bend: Floats1
    excess: Floats1
    reach: float
    outcome: Integers1 | None = None
    history_low: Floats1 | None = None
    history_median: Floats1 | None = None
    history_high: Floats1 | None = None
    seconds: Floats1 | None = None


class ReachedDetails(Details, frozen=True):
    """The tolerance [m], whether the solver starts warm, and what is reached for."""

    tolerance: float = math.nan
    warm: bool | None = None
    stratum: str = ""
    curve: str = ""


KINDS = {CHAIN: Kind(Reached, ReachedDetails)}
