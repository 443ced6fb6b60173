"""The records of falling cloths: work and precision, iterations, limits of stability."""

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import LIU, MISSING, MOTION, NEEDED, ONE_STEP, STABILITY


class StepWork(Values, frozen=True):
    """One step with ever more work, (rung,)."""

    particles: Integers1  # along a side
    seconds: Floats1
    error: Floats1  # |x - x*| / |y - x*|
    remark_particles: Integers1  # along a side of the cloth of each remark, (remark,)


class MotionWork(Values, frozen=True):
    """Motions with ever more work, (rung,), and how sure the true ones are, (size,)."""

    particles: Integers1  # along a side
    frames: Integers1  # that the motion got to
    wanted: Integers1  # frames that it was to get to
    seconds: Floats1  # for a frame
    setup: Floats1  # time to set the solver up [s]
    implicit: Floats1  # distance from converged implicit Euler in the end [m]
    true: Floats1  # distance from the true motion in the end [m]
    diverged: Booleans1
    remark_particles: Integers1  # along a side of the cloth of each remark, (remark,)
    order: Floats1  # observed, of the true motion
    unsure: Floats1  # by how much halving its steps moves the true motion [m]


class Counted(Values, frozen=True):
    """Iterations to each of `DECADES`, NaN where those tried do not suffice; the least error."""

    needed: Floats1
    tried: int
    least: float


class Stability(Values, frozen=True):
    """The longest stable step [s] and the highest frequency [rad/s] by stiffness [N/m]."""

    stiffness: Floats1
    limit: Floats1
    frequency: Floats1


class Published(Values, frozen=True):
    """The cloth of Liu et al. (2013): times of a frame [s], the error left, and its particles."""

    seconds: Floats1
    error: float
    vertices: int


class FallDetails(Details, frozen=True):
    """Which cloth falls, and with which settings it is solved."""

    stiffness: float  # of the springs [N/m]
    frame: float  # its length [s]
    size: int = 0  # particles along a side
    cloth: str = ""  # the name of a user's cloth
    rungs: tuple[str, ...] = ()  # the settings, (rung,)
    remarks: tuple[str, ...] = ()  # what happened, (remark,)


class ClothDetails(Details, frozen=True):
    """Why an engine is missing, or what is to be said of its stability."""

    remark: str = ""


KINDS = {
    ONE_STEP: Kind(StepWork, FallDetails),
    MOTION: Kind(MotionWork, FallDetails),
    NEEDED: Kind(Counted, FallDetails),
    STABILITY: Kind(Stability, ClothDetails),
    LIU: Kind(Published, ClothDetails),
    MISSING: Kind(Values, ClothDetails),
}
