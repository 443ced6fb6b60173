"""The camera of scenes: its directions, and parallel projection."""

import numpy as np

from plumbob.reference.arguments import FloatArray

# Azimuth about the vertical and height above the floor [rad]. An arm draws on the floor, which is
# seen almost face-on, with z up.
ARM_VIEW = (np.radians(180.0), np.radians(75.0))
CLOTH_VIEW = (np.radians(-38.0), np.radians(18.0))


def project(
    points: FloatArray, view: tuple[float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the coordinates of points in the picture: right, up, and towards the camera."""
    azimuth, height = view
    x, y, z = np.moveaxis(points, -1, 0)
    right = np.cos(azimuth) * x + np.sin(azimuth) * z
    toward = -np.sin(azimuth) * x + np.cos(azimuth) * z
    up = np.cos(height) * y - np.sin(height) * toward
    return right, up, np.sin(height) * y + np.cos(height) * toward
