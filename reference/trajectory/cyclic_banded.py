"""Symmetric block systems whose frames are coupled to the next, the last perhaps to the first.

A cycle has no narrow band in its own order. Numbered 0, 2, 4 .. along one half and .. 5, 3, 1 back
along the other, neighbours are at most two apart, and one banded Cholesky factor solves it.
"""

import numpy as np
import scipy.linalg

from ..arguments import FloatArray
from ..backend.compiled import Kernel


class CyclicBandedSystem:
    """A positive definite system, filled and solved many times: n unknowns for each frame."""

    def __init__(self, frames: int, unknowns: int, closed: bool) -> None:
        """Number the frames and allocate the band; `closed` couples the last to the first."""
        number = np.arange(frames)
        if closed:
            number = np.where(2 * number < frames, 2 * number, 2 * (frames - number) - 1)
        self._number = number
        furthest = 2 if closed and frames > 2 else 1
        self._band = np.empty((frames * unknowns, (furthest + 1) * unknowns))

    def fill(self, diagonal: FloatArray, coupling: FloatArray) -> None:
        """Set the blocks (frame, n, n) and those of each frame's successor by it, (.., n, n)."""
        _fill(diagonal, coupling, self._number, self._band)

    def solve(self, b: FloatArray, shift: float) -> FloatArray | None:
        """Return x of (A + shift 1) x = b, (frame, n); None if it is not positive definite."""
        band, permuted = self._band.copy(), np.empty_like(b)
        band[:, 0] += shift
        permuted[self._number] = b
        try:
            factor = scipy.linalg.cholesky_banded(
                band.T, lower=True, overwrite_ab=True, check_finite=False
            )
        except np.linalg.LinAlgError:
            return None
        x = scipy.linalg.cho_solve_banded((factor, True), permuted.ravel(), check_finite=False)
        return x.reshape(b.shape)[self._number]


def fill_band(diagonal, coupling, number, band):
    """Fill the lower band, whose row c holds column c of the matrix from the diagonal on."""
    frames, n = diagonal.shape[0], diagonal.shape[1]
    band[:] = 0.0
    for f in range(frames):
        first = number[f] * n
        for b in range(n):
            for a in range(b, n):
                band[first + b, a - b] = diagonal[f, a, b]
    for f in range(len(coupling)):
        row, successor = number[f], number[(f + 1) % frames]
        for a in range(n):
            for b in range(n):
                if successor > row:
                    band[row * n + b, (successor - row) * n + a - b] = coupling[f, a, b]
                else:
                    band[successor * n + a, (row - successor) * n + b - a] = coupling[f, a, b]


_fill = Kernel(fill_band)
