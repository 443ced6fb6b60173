"""Resampling."""

import numpy as np


def resample(curve, closed, count=None, spacing=None):
    points = np.vstack([curve, curve[:1]]) if closed else curve
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arc = np.append(0.0, np.cumsum(gaps))  # the length along the curve at each point
    if count is None:
        count = int(np.ceil(arc[-1] / spacing - 1e-12)) + (not closed)
    s = np.linspace(0.0, arc[-1], count, endpoint=not closed)
    return np.stack([np.interp(s, arc, axis) for axis in points.T], axis=1)
