"""The records of closed curves: a round, whose last angles lead back, and repetitions."""

from ...harness.values import Details, Floats1, Kind, Values
from ..arm.values import FollowedMotion
from . import CURVE, DRIFT


class DriftAngles(Values, frozen=True):
    """The largest angle of a joint from its first pose after each repetition [rad]."""

    drift: Floats1
    residual: Floats1


class TrackingDetails(Details, frozen=True):
    """The mode in which the frames are solved, and the tolerance [m]."""

    mode: str
    tolerance: float


KINDS = {
    CURVE: Kind(FollowedMotion, TrackingDetails),
    DRIFT: Kind(DriftAngles, TrackingDetails),
}
