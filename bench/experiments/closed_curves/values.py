"""The records of closed curves: one round, whose last angles lead back, and repetitions."""

from ...harness.values import Details, Floats1, Kind, Values
from ..arm.values import Followed
from . import CURVE, DRIFT


class Drifted(Values, frozen=True):
    """How far the first pose is left behind after each repetition [rad], (repetition,)."""

    drift: Floats1
    residual: Floats1


class RoundDetails(Details, frozen=True):
    """How the frames are solved, and to which tolerance [m]."""

    mode: str
    tolerance: float


KINDS = {CURVE: Kind(Followed, RoundDetails), DRIFT: Kind(Drifted, RoundDetails)}
