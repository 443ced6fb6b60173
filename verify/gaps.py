"""How far two answers are apart."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np


def difference(first: Mapping[str, Any], second: Mapping[str, Any]) -> float:
    """Return the largest difference of the outputs in both, relative to the output's size.

    Quaternions, in outputs named rotations, are compared up to their sign. NaN equals NaN. Infinite
    if there is no output in both, or if an output has another shape.
    """
    shared = first.keys() & second.keys()
    return max((_difference(name, first[name], second[name]) for name in shared), default=np.inf)


def _difference(name: str, first: Any, second: Any) -> float:
    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if name.endswith("rotations") and a.shape == b.shape:
        with np.errstate(invalid="ignore"):
            b = b * np.where(np.nansum(a * b, -1, keepdims=True) < 0.0, -1.0, 1.0)
    size = float(np.abs(np.where(np.isfinite(a), a, 0.0)).max(initial=0.0))
    return largest_gap(a, b) / max(size, 1e-300)


def largest_gap(first: Any, second: Any) -> float:
    """Return the largest difference of two arrays, infinite between shapes, or NaN and number."""
    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if a.shape != b.shape:
        return np.inf
    with np.errstate(invalid="ignore"):
        gap = float(np.abs(a - b).max(initial=0.0))
    if math.isfinite(gap):
        return gap
    if (np.isnan(a) != np.isnan(b)).any():
        return np.inf
    return float(np.abs(np.nan_to_num(a) - np.nan_to_num(b)).max(initial=0.0))
