"""Where the camera stands, and what it sees in parallel projection."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Where the camera stands: rotated about the vertical and lifted above the floor [rad]. An arm draws
# on the floor, which is seen almost face-on, with z up.
ARM_VIEW = (np.radians(180.0), np.radians(68.0))
CLOTH_VIEW = (np.radians(-38.0), np.radians(18.0))


def seen(points: Floats, view: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Return where points appear to the right and up, and how near, from an azimuth and height."""
    azimuth, height = view
    x, y, z = np.moveaxis(points, -1, 0)
    right = np.cos(azimuth) * x + np.sin(azimuth) * z
    toward = -np.sin(azimuth) * x + np.cos(azimuth) * z
    up = np.cos(height) * y - np.sin(height) * toward
    return right, up, np.sin(height) * y + np.cos(height) * toward
