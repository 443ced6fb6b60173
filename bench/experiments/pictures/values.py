"""The records of the pictures and motions of the report."""

from ...harness.values import Floats1, Floats2, Floats3, Integers1, Values
from . import ARM, ARM_MOTION, CLOTH, CLOTH_MOTION


class ArmWords(Values, frozen=True, kw_only=True):
    """Whether the curve was resampled."""

    evened: bool


class ArmDrawing(ArmWords, frozen=True):
    """The arm on a curve, point by point [m], [rad], with the joints in a few frames."""

    curve: Floats2
    residual: Floats1
    iterations: Integers1
    largest_angle: Floats1
    mean_angle: Floats1
    spacing: Floats1
    ghosts: Floats3


class ClothDrawing(Values, frozen=True):
    """A cloth in a few frames: positions [m], (frame, particle, 3), their times [s], the pins."""

    positions: Floats3
    time: Floats1
    pinned: Integers1


class MovingArmWords(Values, frozen=True, kw_only=True):
    """The position of the motion in the order."""

    order: int


class MovingArm(MovingArmWords, frozen=True):
    """The arm's joints [m], (frame, joint, 3), the curve, and the error of each frame [m]."""

    positions: Floats3
    curve: Floats2
    error: Floats1


class MovingClothWords(Values, frozen=True, kw_only=True):
    """The step [s], the interval of recorded steps, the iteration limit, the position in order."""

    h: float
    every: int
    iterations: int
    order: int


class MovingCloth(MovingClothWords, frozen=True):
    """A cloth's particles [m], (frame, particle, 3), the error of each [m], the pins."""

    positions: Floats3
    distance: Floats2
    pinned: Integers1


KINDS = {
    ARM: ArmDrawing,
    CLOTH: ClothDrawing,
    ARM_MOTION: MovingArm,
    CLOTH_MOTION: MovingCloth,
}
