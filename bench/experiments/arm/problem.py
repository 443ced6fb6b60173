"""The lab's arm drawing the named curves, and reaching for what is too far away."""

from dataclasses import dataclass

import numpy as np

from plumbob.reference import Articulation, Skeleton, curves, resample, scenes
from plumbob.reference.arguments import FloatArray

from ..chain.problem import TargetsForSkeleton, unit

# Samples of each curve, as the lab takes them; the custom curve is resampled from a raw drawing.
FRAMES = {"circle": 150, "square": 150, "heart": 150, "triangle": 150, "star": 400}
CUSTOM = "plumb_bob"
CUSTOM_SAMPLES = 1200
MIN_SPACING = 0.01
MAX_SPACING = 0.02
BEYOND = (1.01, 2.0)
_SEED = 1986


@dataclass(frozen=True)
class FollowedCurve:
    """A curve that an effector is to follow, frame by frame.

    Attributes:
        name: of the problem.
        title: how it is written.
        model: what follows.
        start: its pose at the start: local rotations of a Skeleton, else coordinates.
        curve: the target of the effector in each frame [m], (frame, 3).
    """

    name: str
    title: str
    model: Skeleton | Articulation
    start: FloatArray
    curve: FloatArray


def arm_curves() -> list[FollowedCurve]:
    """Return the arm with every named curve; the custom one evened out."""
    skeleton, rest = scenes.lab_arm()
    even = {name: curves[name](frames) for name, frames in FRAMES.items()}
    even[CUSTOM] = evened_custom_curve()
    return [
        FollowedCurve(f"arm/{name}", spaced(name), skeleton, rest, curve)
        for name, curve in even.items()
    ]


def spaced(name: str) -> str:
    """Return how the name of a curve is written."""
    return name.replace("_", " ")


def custom_curve() -> FloatArray:
    """Return the custom curve as it is drawn, unevenly sampled [m], (point, 3)."""
    return curves[CUSTOM](CUSTOM_SAMPLES)


def evened_custom_curve() -> FloatArray:
    """Return the custom curve resampled between the two spacings [m], (frame, 3)."""
    return resample(custom_curve(), min_spacing=MIN_SPACING, max_spacing=MAX_SPACING)


def arm_beyond(count: int) -> TargetsForSkeleton:
    """Return seeded targets in all directions, farther from the arm's root than it can reach."""
    skeleton, rest = scenes.lab_arm()
    rng = np.random.default_rng(_SEED)
    distances = skeleton.reach() * rng.uniform(*BEYOND, count)
    targets = skeleton.offsets[0] + distances[:, None] * unit(rng.standard_normal((count, 3)))
    return TargetsForSkeleton("arm/beyond", "arm, beyond", skeleton, rest, targets)
