"""The records of falling cloths: work and precision, iterations, limits of stability."""

from ...harness.values import Booleans1, Details, Floats1, Integers1, Kind, Values
from . import LIU, MISSING, MOTION, NEEDED, ONE_STEP, STABILITY


class StepWork(Values, frozen=True):
    """One step with ever more work, (rung,).

    Attributes:
        particles: along a side.
        seconds: for the step.
        error: |x - x*| / |y - x*|.
        remark_particles: along a side, of the cloth of each remark, (remark,).
    """

    particles: Integers1
    seconds: Floats1
    error: Floats1
    remark_particles: Integers1


class MotionWork(Values, frozen=True):
    """Motions with ever more work, (rung,), and how sure the true ones are, (size,).

    Attributes:
        particles: along a side.
        frames: that the motion got to.
        wanted: frames that it was to get to.
        seconds: for a frame.
        setup: the time to set the solver up [s].
        implicit: distance from converged implicit Euler in the end [m].
        true: distance from the true motion in the end [m].
        diverged: whether a particle was ever too far away.
        remark_particles: along a side, of the cloth of each remark, (remark,).
        order: observed, of the true motion.
        unsure: by how much halving its steps moves the true motion [m].
    """

    particles: Integers1
    frames: Integers1
    wanted: Integers1
    seconds: Floats1
    setup: Floats1
    implicit: Floats1
    true: Floats1
    diverged: Booleans1
    remark_particles: Integers1
    order: Floats1
    unsure: Floats1


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


class ClothDetails(Details, frozen=True):
    """Which cloth it is.

    Attributes:
        size: particles along a side.
        stiffness: of the springs [N/m].
        frame: the length of a frame [s].
        cloth: the name of a user's cloth.
        rungs: the settings, (rung,).
        remarks: sentences on what happened, (remark,).
        remark: why an engine is missing, or what is to be said of its stability.
    """

    size: int = 0
    stiffness: float = 0.0
    frame: float = 0.0
    cloth: str = ""
    rungs: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    remark: str = ""


KINDS = {
    ONE_STEP: Kind(StepWork, ClothDetails),
    MOTION: Kind(MotionWork, ClothDetails),
    NEEDED: Kind(Counted, ClothDetails),
    STABILITY: Kind(Stability, ClothDetails),
    LIU: Kind(Published, ClothDetails),
    MISSING: Kind(Values, ClothDetails),
}
