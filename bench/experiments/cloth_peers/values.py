"""The records of falling cloths: work and precision, limits of stability."""

import msgspec

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import LIU, MISSING, MOTION, ONE_STEP, STABILITY


class StepWork(Values, frozen=True):
    """A step at increasing cost, (rung,), and the precision that single precision allows, (size,).

    A sweep measures every rung once.
    """

    particles: Integers1  # along a side
    seconds: Floats1
    error: Floats1  # |x - x*| / |y - x*|
    remark_particles: Integers1  # along a side of the cloth of each remark, (remark,)
    rounding: Floats1 | None = None  # the error of x* rounded to single precision


class MotionWork(Values, frozen=True):
    """Motions at increasing cost, (rung,), and the accuracy of the true motions, (size,)."""

    particles: Integers1  # along a side
    frames: Integers1  # number of frames reached
    target_frames: Integers1 = msgspec.field(name="wanted")
    seconds: Floats1  # for a frame
    setup: Floats1  # time to set the solver up [s]
    true: Floats1  # final distance from the true motion [m]
    path: Floats1  # distance that the true motion moved until then [m]
    diverged: Booleans1
    remark_particles: Integers1  # along a side of the cloth of each remark, (remark,)
    order: Floats1  # observed, of the true motion
    unsure: Floats1  # distance by which halved steps move the true motion [m]


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


class FallDetails(Details, frozen=True):
    """The falling cloth, and the settings of its solver."""

    stiffness: float  # of the springs [N/m]
    frame: float  # its length [s]
    size: int = 0  # particles along a side
    cloth: str = ""  # the name of a user's cloth
    rungs: tuple[str, ...] = ()  # the settings, (rung,)
    remarks: tuple[str, ...] = ()
    kind: str = ""  # how the solver's settings differ, see `registry`
    sweep: int = 1  # the pass over all solvers in which it was measured
    arbiter: str = ""  # what the errors are measured against, and to how many digits


class ClothDetails(Details, frozen=True):
    """The reason why an engine is missing, or a remark on its stability."""

    remark: str = ""


KINDS = {
    ONE_STEP: Kind(StepWork, FallDetails),
    MOTION: Kind(MotionWork, FallDetails),
    STABILITY: Kind(StabilityLimits, ClothDetails),
    LIU: Kind(LiuFrame, ClothDetails),
    MISSING: Kind(Values, ClothDetails),
}
