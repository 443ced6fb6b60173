"""Resample by walking."""

import numpy as np


def resample(curve, closed, count=None, spacing=None):
    points = [*curve, curve[0]] if closed else [*curve]
    total = 0.0
    for k in range(len(points) - 1):
        total += np.linalg.norm(points[k + 1] - points[k])
    if count is None:
        count = int(np.ceil(total / spacing - 1e-12)) + (0 if closed else 1)
    step = total / count if closed else total / max(count - 1, 1)
    result, k, walked = [], 0, 0.0
    for m in range(count):
        s = m * step
        length = np.linalg.norm(points[k + 1] - points[k])
        while walked + length < s and k < len(points) - 2:
            walked += length
            k += 1
            length = np.linalg.norm(points[k + 1] - points[k])
        t = (s - walked) / length if length > 0.0 else 0.0
        t = min(t, 1.0)
        result.append(points[k] + t * (points[k + 1] - points[k]))
    return np.array(result)
