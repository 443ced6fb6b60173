"""The records of the timing: rounds, and the timed work."""

import math

from ...harness.values import Floats2, Values


class WorkWords(Values, frozen=True, kw_only=True):
    """The timed work: see `case.TimedWork`."""

    subject: str
    group: str
    work: str
    noise: float = math.nan  # half the width of the middle 80 % of a fixed loop's times
    together: str = ""  # a word that all cases timed in turns have in common


class RoundTimes(WorkWords, frozen=True):
    """The seconds of an operation, (sweep, round), and the bytes moved as a yardstick."""

    seconds: Floats2
    moved: float
    error: float | None = None  # that a tolerance leaves, relative to the length of the step


KINDS = {"": RoundTimes}
