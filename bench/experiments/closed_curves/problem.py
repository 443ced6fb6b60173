"""Closed curves to be followed by the lab's arm and by a robot arm of seven hinges."""

from dataclasses import dataclass

import numpy as np

from reference import Articulation, Skeleton, curves, resample, scenes
from reference.arguments import FloatArray
from reference.formats import urdf

from ..arm.problem import CUSTOM, FRAMES, MAX_SPACING, MIN_SPACING, custom_curve, spaced
from ..robots.problem import robot

ARM_CURVES = ("circle", "heart", "triangle", "star")
ROBOT, ROBOT_CURVES = "iiwa14", ("circle", "heart")
# A pose with the elbow bent and the wrist over the table [°], and where the curves are drawn [m]:
# upright, in front of the robot, so small that all of it is within reach.
_START = (0.0, 35.0, 0.0, 80.0, 0.0, 65.0, 0.0)
_CENTRE, _SCALE = (0.5, 0.0, 0.5), 0.4
# Frames of the heart where it is drawn several times.
DRIFT_FRAMES = 60


@dataclass(frozen=True)
class ClosedCurve:
    """A closed curve to be followed.

    Attributes:
        name: of the problem.
        title: how it is written.
        model: what follows.
        start: its pose at the start: local rotations of a Skeleton, else coordinates.
        curve: where the effector is wanted in each frame [m], (frame, 3).
    """

    name: str
    title: str
    model: Skeleton | Articulation
    start: FloatArray
    curve: FloatArray


def arm_closed_curves() -> list[ClosedCurve]:
    """Return the lab's arm on the lab's curves; the custom one evened out, its ends joined."""
    skeleton, rest = scenes.lab_arm()
    drawn = {name: curves[name](FRAMES[name]) for name in ARM_CURVES}
    spacing = {"min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
    drawn[CUSTOM] = resample(custom_curve(), closed=True, **spacing)
    return [
        ClosedCurve(f"arm/{name}", f"arm, {spaced(name)}", skeleton, rest, curve)
        for name, curve in drawn.items()
    ]


def robot_closed_curves() -> list[ClosedCurve]:
    """Return a robot arm of seven hinges with limits on two of the curves."""
    arm = urdf.parse(robot(ROBOT).text).articulation
    return [
        ClosedCurve(
            f"{ROBOT}/{name}", f"{ROBOT}, {name}", arm, np.radians(_START),
            _SCALE * curves[name](FRAMES[name])[:, [0, 2, 1]] + _CENTRE,
        )
        for name in ROBOT_CURVES
    ]  # fmt: skip


def heart_three_times() -> ClosedCurve:
    """Return the lab's arm on the heart, three times over."""
    skeleton, rest = scenes.lab_arm()
    return ClosedCurve(
        "drift/heart", "drift, heart", skeleton, rest,
        np.tile(curves["heart"](DRIFT_FRAMES), (3, 1)),
    )  # fmt: skip
