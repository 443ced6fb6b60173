"""Formulas in the catalogue of robots' faults: expressions of named numbers."""

from collections.abc import Mapping
from functools import cache
from types import CodeType
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

UPRIGHT = np.array([0.0, 0.0, 1.0])


def _at(row: int, column: int) -> FloatArray:
    """Return the matrix (3, 3) with 1 at a row and a column, else 0."""
    return np.eye(9)[3 * row + column].reshape(3, 3)


def _product(A: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return matrices times vectors, (..., 3)."""
    return np.asarray(np.einsum("...ij,...j->...i", A, vectors))


def _axes_of_angles(R: FloatArray) -> FloatArray:
    """Return the axes about which roll, pitch and yaw rotate, in the columns of (..., 3, 3)."""
    roll = R[..., 0]
    pitch = np.cross(UPRIGHT, roll)
    pitch = pitch / np.linalg.norm(pitch, axis=-1, keepdims=True)
    return np.stack([roll, pitch, np.broadcast_to(UPRIGHT, roll.shape)], axis=-1)


def branches(R: FloatArray) -> FloatArray:
    """Return the branches in which quaternions of matrices are computed (Shepperd 1978).

    Where the trace is positive it is 0, and else that of the largest of x, y and z, 1 to 3.
    """
    diagonals = np.diagonal(R, axis1=-2, axis2=-1)
    return np.where(diagonals.sum(axis=-1) > 0.0, 0, 1 + diagonals.argmax(axis=-1))


def _through_quaternions(R: FloatArray, branch: int, component: int) -> FloatArray:
    """Return the matrices of quaternions of which a number is negated in a branch."""
    q = np.array(rotation.from_matrix(R))
    q[branches(R) == branch, component] *= -1.0
    return rotation.to_matrix(q)


def _solve(A: FloatArray, b: FloatArray) -> FloatArray:
    """Return the solutions of A x = b, (..., n)."""
    return np.asarray(np.linalg.solve(A, b[..., None])[..., 0])


# What formulas may use: T transposes, `product` rotates vectors by matrices.
_GLOBALS: dict[str, Any] = {
    "np": np,
    "abs": np.abs,
    "at": _at,
    "axes_of_angles": _axes_of_angles,
    "inf": np.inf,
    "conjugate": rotation.conjugate,
    "product": _product,
    "roll": np.roll,
    "rotate": rotation.rotate,
    "T": lambda A: np.swapaxes(A, -1, -2),
    "diagonal": lambda A: A * np.eye(A.shape[-1]),
    "lower_of": np.tril,
    "solve": _solve,
    "through_quaternions": _through_quaternions,
    "up": UPRIGHT,
    "upper_of": np.triu,
    "where": np.where,
}


@cache
def _compiled(formula: str) -> CodeType:
    return compile(formula, "faults.toml", "eval")


def evaluate(formula: str, names: Mapping[str, Any]) -> Any:
    """Return the value of a formula of names."""
    return eval(_compiled(formula), _GLOBALS, names)
