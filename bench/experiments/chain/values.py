"""The records of a chain reaching for targets."""

import math

from ...harness.values import Booleans1, Floats1, Floats2, Integers1, Values
from . import CHAIN


class SolveWords(Values, frozen=True, kw_only=True):
    """The tolerance [m], whether the solver starts warm, and the stratum or curve."""

    tolerance: float = math.nan
    warm: bool | None = None
    stratum: str = ""
    curve: str = ""


class ChainSolves(SolveWords, frozen=True):
    """The solutions of a batch of targets, (target,); lengths in metres."""

    residual: Floats1  # infinite without a solution
    iterations: Floats1  # NaN where the solver does not report them
    distance: Floats1  # of the target from the root
    bend: Floats1  # of the farthest joint from the line from root to target
    excess: Floats1  # residual above distance - reach
    reach: float
    solved: Booleans1 | None = None  # whether the residual is within the tolerance
    outcome: Integers1 | None = None  # the number of an `Outcome`, of our solvers
    history_low: Floats1 | None = None  # 10th percentile of the residuals by iteration
    history_median: Floats1 | None = None
    history_high: Floats1 | None = None  # 90th percentile
    seconds: Floats2 | None = None  # of the first targets, (round, target)
    control: Floats1 | None = None  # of a fixed loop before each round
    # 1 or 0 as a user's solver claims, or -1 for no claim
    claims: Integers1 | None = None


KINDS = {CHAIN: ChainSolves}
