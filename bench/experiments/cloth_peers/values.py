"""The records of falling cloths: work and precision, limits of stability."""

from ...harness.values import Floats1, Integers1, Values
from . import LIU, MISSING, MOTION, ONE_STEP, STABILITY


class FallWords(Values, frozen=True, kw_only=True):
    """The falling cloth, and the settings of its solver."""

    stiffness: float  # of the springs [N/m]
    cloth: str = ""  # the name of a user's cloth
    rungs: tuple[str, ...] = ()  # the settings, (rung,)
    remarks: tuple[str, ...] = ()  # on each setting, (rung,)
    kind: str = ""  # how the solver's settings differ, see `Run`
    sweep: int = 1  # the pass over all solvers in which it was measured


class Work(FallWords, frozen=True):
    """A step or a motion at increasing cost, (rung,), and how sure its arbiter is, (size,).

    A sweep measures every rung once.
    """

    particles: Integers1  # along a side
    seconds: Floats1  # for a frame
    setup: Floats1  # time to set the solver up [s]
    # |x - x*| / |y - x*| of a step; of a motion, distance from the truth over distance moved
    error: Floats1
    rounding: Floats1 | None = None  # the error of x* rounded to single precision
    order: Floats1 | None = None  # observed, of the true motion
    unsure: Floats1 | None = None  # share of the distance by which halved steps move the truth


class StabilityLimits(Values, frozen=True):
    """The longest stable step [s] and the highest frequency [rad/s] by stiffness [N/m]."""

    stiffness: Floats1
    limit: Floats1
    frequency: Floats1


class LiuFrame(Values, frozen=True):
    """The cloth of Liu et al. (2013): times of a frame [s], the final error, and its particles."""

    seconds: Floats1
    error: float
    vertices: int


KINDS = {
    ONE_STEP: Work,
    MOTION: Work,
    STABILITY: StabilityLimits,
    LIU: LiuFrame,
    MISSING: Values,
}
