"""The records of the timing: rounds, and what was done in them."""

import math

from ...harness.values import Details, Floats2, Kind, Values


class Timed(Values, frozen=True):
    """The seconds of one operation, (sweep, round), and the bytes that it moves as a yardstick."""

    seconds: Floats2
    moved: float


class WorkDetails(Details, frozen=True):
    """What was timed.

    Attributes:
        subject: kinematics, ik or cloth.
        group: what the work is done on.
        work: how the work is written within its group.
        noise: half the width of the middle eight tenths of a fixed loop's times, over their median.
        together: a word that all that were timed in turns have in common.
    """

    subject: str
    group: str
    work: str
    noise: float = math.nan
    together: str = ""


KINDS = {"": Kind(Timed, WorkDetails)}
