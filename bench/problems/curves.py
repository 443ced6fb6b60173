"""Curves followed by the lab's arm and a robot of seven hinges; targets too far away."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from plumbob.reference import Articulation, Skeleton, curves, resample, scenes
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf

from .chains import TargetsForSkeleton, unit
from .robots import robot

# The task of records on a curve.
CURVE = "curve"
# Samples of each curve, as taken in the lab; the custom curve is resampled from a raw drawing.
FRAMES = {"circle": 150, "square": 150, "heart": 150, "triangle": 150, "star": 400}
CUSTOM = "plumb_bob"
CUSTOM_SAMPLES = 1200
# Distances of neighbouring samples [m].
MIN_SPACING, MAX_SPACING = 0.01, 0.02
# Distances of targets out of reach, over the reach: from nearly straight to far.
BEYOND = (1.01, 2.0)
_SEED = 1986  # of these targets
# Closed curves, and where a robot draws them.
ARM_CURVES = ("circle", "heart", "triangle", "star")
ROBOT, ROBOT_CURVES = "iiwa14", ("circle", "heart")
# A pose with the elbow bent and the wrist over the table [°], and where the curves are drawn [m].
# Curves are upright, in front of the robot, and small enough to be all within reach.
_START = (0.0, 35.0, 0.0, 80.0, 0.0, 65.0, 0.0)
_CENTRE, _SCALE = (0.5, 0.0, 0.5), 0.4  # scale: size of a curve over its size in the lab
# Frames of the heart where drawn several times.
DRIFT_FRAMES = 60


@dataclass(frozen=True)
class FollowedCurve:
    """A curve for an effector to follow, frame by frame."""

    name: str  # of the problem
    title: str  # how it is written
    model: Skeleton | Articulation  # the arm
    start: FloatArray  # its initial pose: local rotations of a Skeleton, else coordinates
    curve: FloatArray  # the target of the effector in each frame [m], (frame, 3)


def arm_curves() -> list[FollowedCurve]:
    """Return the arm with every named curve, the custom curve resampled evenly."""
    drawn = {name: curves[name](frames) for name, frames in FRAMES.items()}
    drawn[CUSTOM] = evened_custom_curve()
    return _of_arm(drawn)


def _of_arm(drawn: dict[str, FloatArray], before: str = "") -> list[FollowedCurve]:
    """Return the lab's arm with curves by their names; words before a name begin its title."""
    skeleton, rest = scenes.lab_arm()
    return [
        FollowedCurve(f"arm/{name}", before + name.replace("_", " "), skeleton, rest, curve)
        for name, curve in drawn.items()
    ]


def custom_curve() -> FloatArray:
    """Return the custom curve as drawn, unevenly sampled [m], (point, 3)."""
    return curves[CUSTOM](CUSTOM_SAMPLES)


def evened_custom_curve(closed: bool = False) -> FloatArray:
    """Return the custom curve resampled between the two spacings [m], (frame, 3)."""
    spacing = {"min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
    return resample(custom_curve(), closed=closed, **spacing)


def arm_beyond(count: int) -> TargetsForSkeleton:
    """Return seeded targets in all directions, farther from the arm's root than its reach."""
    skeleton, rest = scenes.lab_arm()
    rng = np.random.default_rng(_SEED)
    distances = skeleton.reach() * rng.uniform(*BEYOND, count)
    targets = skeleton.offsets[0] + distances[:, None] * unit(rng.standard_normal((count, 3)))
    return TargetsForSkeleton("arm/beyond", "arm, beyond", skeleton, rest, targets)


@functools.cache
def arm_closed_curves() -> Sequence[FollowedCurve]:
    """Return the lab's arm on the lab's curves, the custom curve resampled and closed."""
    drawn = {name: curves[name](FRAMES[name]) for name in ARM_CURVES}
    drawn[CUSTOM] = evened_custom_curve(closed=True)
    return _of_arm(drawn, "arm, ")


def robot_closed_curves() -> list[FollowedCurve]:
    """Return a robot arm of seven hinges with limits on two of the curves."""
    arm = urdf.parse(robot(ROBOT).text).articulation
    drawn = {name: _SCALE * curves[name](FRAMES[name])[:, [0, 2, 1]] for name in ROBOT_CURVES}
    return [
        FollowedCurve(
            f"{ROBOT}/{name}", f"{ROBOT}, {name}", arm, np.radians(_START), curve + _CENTRE
        )
        for name, curve in drawn.items()
    ]


def heart_three_times() -> FollowedCurve:
    """Return the lab's arm on the heart, three times over."""
    skeleton, rest = scenes.lab_arm()
    thrice = np.tile(curves["heart"](DRIFT_FRAMES), (3, 1))
    return FollowedCurve("drift/heart", "drift, heart", skeleton, rest, thrice)
