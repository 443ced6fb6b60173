"""Resample by arc lengths."""

import numpy as np


def resample(curve, closed, count=None, spacing=None):
    points = [*curve, curve[0]] if closed else [*curve]
    arc = np.zeros(len(points))  # the length along the curve at each point
    for k in range(1, len(points)):
        arc[k] = arc[k - 1] + np.linalg.norm(points[k] - points[k - 1])
    if count is None:
        gaps = max(1, int(np.ceil(arc[-1] / spacing - 1e-9)))
        count = gaps if closed else gaps + 1
    gaps = count if closed else max(count - 1, 1)
    result, k = np.zeros((count, 3)), 0
    for m in range(count):
        s = m / gaps * arc[-1]
        while k < len(points) - 2 and arc[k + 1] < s:
            k += 1
        span = arc[k + 1] - arc[k]
        t = (s - arc[k]) / span if span > 0.0 else 0.0
        t = min(t, 1.0)
        result[m] = points[k] + t * (points[k + 1] - points[k])
    if not closed:
        result[-1] = points[-1]
    return result
