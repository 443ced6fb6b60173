"""The records of closed curves: a round, whose last angles lead back, and repetitions."""

from ...harness.values import Floats1, Integers1, Values
from . import CURVE, DRIFT


class TrackingWords(Values, frozen=True, kw_only=True):
    """The mode in which the frames are solved, and the tolerance [m]."""

    mode: str
    tolerance: float


class TrackedCurve(TrackingWords, frozen=True):
    """A closed motion, as `FollowedMotion` of the arm, (frame,)."""

    residual: Floats1
    iterations: Integers1
    outcome: Integers1
    largest_angle: Floats1
    mean_angle: Floats1


class DriftAngles(TrackingWords, frozen=True):
    """The largest angle of a joint from its first pose after each repetition [rad]."""

    drift: Floats1
    residual: Floats1


KINDS = {CURVE: TrackedCurve, DRIFT: DriftAngles}
