"""Closed curves to be followed by the lab's arm and by a robot arm of seven hinges."""

import functools
from collections.abc import Sequence

import numpy as np

from plumbob.reference import curves, resample, scenes
from plumbob.reference.formats import urdf

from ..arm.problem import (
    CUSTOM,
    FRAMES,
    MAX_SPACING,
    MIN_SPACING,
    FollowedCurve,
    custom_curve,
    spaced,
)
from ..robots.problem import robot

ARM_CURVES = ("circle", "heart", "triangle", "star")
ROBOT, ROBOT_CURVES = "iiwa14", ("circle", "heart")
# A pose with the elbow bent and the wrist over the table [°], and where the curves are drawn [m]:
# upright, in front of the robot, so small that all of it is within reach.
_START = (0.0, 35.0, 0.0, 80.0, 0.0, 65.0, 0.0)
_CENTRE, _SCALE = (0.5, 0.0, 0.5), 0.4
# Frames of the heart where it is drawn several times.
DRIFT_FRAMES = 60


@functools.cache
def arm_closed_curves() -> Sequence[FollowedCurve]:
    """Return the lab's arm on the lab's curves; the custom one evened out, its ends joined."""
    skeleton, rest = scenes.lab_arm()
    drawn = {name: curves[name](FRAMES[name]) for name in ARM_CURVES}
    spacing = {"min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
    drawn[CUSTOM] = resample(custom_curve(), closed=True, **spacing)
    return [
        FollowedCurve(f"arm/{name}", f"arm, {spaced(name)}", skeleton, rest, curve)
        for name, curve in drawn.items()
    ]


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
