"""Wahba's problem: the rotation that brings arms nearest to where they are wanted."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from plumbob.reference import rotation
from plumbob.reference.inverse_kinematics.wahba import (
    IDENTITY_WEIGHT,
    ZERO_MATRIX,
    add_outer,
    best_angle,
    best_rotation,
)

# Sums of nine products, an eigenvector of a 4 x 4 matrix: a few dozen roundings of M's size.
ROUNDING = 1e-14

numbers = st.floats(-1.0, 1.0)
vectors = st.lists(numbers, min_size=3, max_size=3)
matrices = st.lists(numbers, min_size=9, max_size=9).map(tuple)
rotations = vectors.map(lambda v: rotation.exponential(3.0 * np.array(v)))
axes = vectors.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


def best(M):
    return np.array(best_rotation(M, np.full((4, 4), np.nan), np.full((4, 4), np.nan)))


def outer(weights, ends, arms):
    """Return M of weighted arms and ends, as the kernels add it up."""
    M = ZERO_MATRIX
    for weight, b, a in zip(weights, ends, arms, strict=True):
        M = add_outer(M, weight, tuple(b), tuple(a))
    return M


def largest_value(M):
    """Return the maximum of tr(S M') over rotations, by singular values (Kabsch 1976)."""
    U, s, Vt = np.linalg.svd(np.reshape(M, (3, 3)))
    return s[0] + s[1] + s[2] * np.sign(np.linalg.det(U @ Vt))


def value(M, S):
    return np.einsum("...ij,ij->...", rotation.to_matrix(S), np.reshape(M, (3, 3)))


@given(M=matrices)
@example(M=(0.0,) * 9)
@example(M=(1.0,) + (0.0,) * 8)
@example(M=(-1.0,) + (0.0,) * 8)
@example(M=(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0))
@example(M=(-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0))
@example(M=(0.0, 0.0, 0.0, 1e-150, 0.0, 0.0, 0.0, 0.0, 0.0))
def test_no_rotation_is_better_than_the_best(M):
    """The least rotation's share of M's size can cost itself times the four of a trace."""
    S = best(M)
    assert np.linalg.norm(S) == pytest.approx(1.0, abs=ROUNDING)
    assert S[0] >= 0.0
    size = np.abs(M).sum()
    assert value(M, S) >= largest_value(M) - (4.0 * IDENTITY_WEIGHT + ROUNDING) * size


@given(M=matrices)
def test_the_best_rotation_is_never_worse_than_none(M):
    """Whatever the least rotation adds: this is why CCD never moves away."""
    assert value(M, best(M)) >= value(M, rotation.identity()) - ROUNDING * np.abs(M).sum()


@given(a=axes, b=axes, lengths=st.lists(st.floats(0.1, 3.0), min_size=1, max_size=3))
def test_collinear_arms_take_the_least_rotation(a, b, lengths):
    """Any twist about the line fits as well; the share of M's size that picks one shortens it."""
    M = outer([1.0] * len(lengths), np.outer(lengths, b), np.outer(lengths, a))
    Q, shortest = best(M), rotation.between(a, b)
    if np.dot(a, b) > -0.99:
        assert rotation.angle(Q, shortest) <= 1e-3
    assert np.dot(rotation.rotate(Q, a), b) >= 1.0 - 1e-5


def test_nothing_to_fit_is_no_rotation():
    assert (best(ZERO_MATRIX) == rotation.identity()).all()


@given(M=matrices, axis=axes)
@example(M=(0.0,) * 9, axis=np.array([0.0, 0.0, 1.0]))
def test_no_angle_about_an_axis_is_better_than_the_best(M, axis):
    angle = best_angle(M, tuple(axis))
    assert -np.pi <= angle <= np.pi
    scan = rotation.exponential(np.linspace(-np.pi, np.pi, 181)[:, None] * axis)
    least = value(M, scan).max() - ROUNDING * np.abs(M).sum()
    assert value(M, rotation.exponential(angle * axis)) >= least
