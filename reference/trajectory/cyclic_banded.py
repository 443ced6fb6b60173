"""Symmetric systems of frames, each coupled to the next, the last one perhaps to the first.

A ring is laid flat: its frames are numbered 0, 2, 4 .. up one side and .. 5, 3, 1 down the other,
so that neighbours are at most two apart, and one Cholesky factor of a band solves it.
"""

import numpy as np
import scipy.linalg

from ..arguments import FloatArray
from ..backend.compiled import TwoSpeeds


class Ring:
    """A system of so many frames of so many unknowns, with room for its band."""

    def __init__(self, frames: int, width: int, closed: bool) -> None:
        """Lay out the frames."""
        number = np.arange(frames)
        if closed:
            number = np.where(2 * number < frames, 2 * number, 2 * (frames - number) - 1)
        self._number = number
        neighbours = 2 if closed and frames > 2 else 1
        self._band = np.empty((frames * width, (neighbours + 1) * width))

    def fill(self, within: FloatArray, between: FloatArray) -> None:
        """Take the blocks of the frames, and of each frame's successor by itself."""
        _fill(within, between, self._number, self._band)

    def solve(self, b: FloatArray, shift: float) -> FloatArray | None:
        """Return x of (A + shift 1) x = b, (frame, unknown); None if not positive definite."""
        band, laid = self._band.copy(), np.empty_like(b)
        band[:, 0] += shift
        laid[self._number] = b
        try:
            factor = scipy.linalg.cholesky_banded(
                band.T, lower=True, overwrite_ab=True, check_finite=False
            )
        except np.linalg.LinAlgError:
            return None
        x = scipy.linalg.cho_solve_banded((factor, True), laid.ravel(), check_finite=False)
        return x.reshape(b.shape)[self._number]


def fill_band(within, between, number, band):
    """Fill the lower band, whose row c holds column c from the diagonal on."""
    frames, n = within.shape[0], within.shape[1]
    band[:] = 0.0
    for f in range(frames):
        at = number[f] * n
        for b in range(n):
            for a in range(b, n):
                band[at + b, a - b] = within[f, a, b]
    for f in range(len(between)):
        here, there = number[f], number[(f + 1) % frames]
        for a in range(n):
            for b in range(n):
                if there > here:
                    band[here * n + b, (there - here) * n + a - b] = between[f, a, b]
                else:
                    band[there * n + a, (here - there) * n + b - a] = between[f, a, b]


_fill = TwoSpeeds(fill_band)
