"""Arrays of unit quaternions, (..., 4), w first; leading axes broadcast.

Hamilton product, active rotations: `rotate(q, v)` rotates v by q, `multiply(a, b)` by b first.
Functions raise a ValueError with the name of an argument that has another shape, numbers not
finite, or lengths too large for memory.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, quaternion
from .arguments import FloatArray
from .backend.compiled import Kernel
from .quaternion import UNIT_TOLERANCE, load_quaternion, load_vector, store_quaternion, store_vector
from .quaternion import between as between_two
from .quaternion import exponential as exponential_of
from .quaternion import logarithm as logarithm_of


def identity(*shape: int) -> FloatArray:
    """Return identity quaternions, (*shape, 4)."""
    result = np.zeros((*arguments.lengths("shape", shape), 4))
    result[..., 0] = 1.0
    return result


def random(rng: np.random.Generator, *shape: int) -> FloatArray:
    """Return uniformly random rotations, (*shape, 4): normalised Gaussian 4-vectors."""
    rng = arguments.instance("rng", rng, np.random.Generator)
    q = rng.standard_normal((*arguments.lengths("shape", shape), 4))
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def unit(name: str, q: ArrayLike) -> FloatArray:
    """Return quaternions within 1e-6 of unit length, (..., 4), made unit; or raise an error."""
    values = arguments.array(name, q, "...", 4)
    lengths = np.linalg.norm(values, axis=-1, keepdims=True)
    check_unit(name, lengths[..., 0])
    return values / lengths


def normalise(quaternions: ArrayLike, name: str = "quaternions") -> tuple[FloatArray, FloatArray]:
    """Return quaternions made unit, (..., 4), and the deviations of their lengths from 1, (...).

    `name` is the argument's, for the error.

    Raises:
        ValueError: if the quaternions are not finite, or a length is zero.
    """
    q = arguments.array(name, quaternions, "...", 4)
    largest = np.abs(q).max(axis=-1, keepdims=True)
    if not largest.all():
        index = tuple(np.argwhere(largest[..., 0] == 0.0)[0].tolist())
        raise ValueError(f"{name}: expected lengths above 0, got 0 at index {index}")
    scaled = q / largest  # no square overflows or vanishes
    lengths = np.linalg.norm(scaled, axis=-1, keepdims=True)
    return scaled / lengths, np.abs(lengths * largest - 1.0)[..., 0]


def check_unit(name: str, lengths: FloatArray) -> None:
    """Raise a ValueError with the first length further than 1e-6 from 1."""
    wrong = np.abs(lengths - 1.0) > UNIT_TOLERANCE
    if wrong.any():
        index = tuple(np.argwhere(wrong)[0].tolist())
        raise ValueError(
            f"{name}: expected unit quaternions (w, x, y, z), "
            f"got one of length {lengths[index]:.9g} at index {index}"
        )


def multiply(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Return the products a b, (..., 4)."""
    a, b = _pair("a", a, 4, "b", b, 4)
    return _stack(quaternion.multiply(_parts(a), _parts(b)))


def conjugate(q: ArrayLike) -> FloatArray:
    """Return the inverse rotations, (..., 4)."""
    return _stack(quaternion.conjugate(_parts(arguments.array("q", q, "...", 4))))


def rotate(q: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return the vectors v, (..., 3), rotated by unit quaternions q, (..., 4)."""
    q, v = _pair("q", q, 4, "v", v, 3)
    return _stack(quaternion.rotate(_parts(q), _parts(v)))


def between(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Return the shortest-arc rotations from directions a to b, (..., 3) each, as (..., 4).

    Antiparallel directions are rotated by pi about a fixed axis perpendicular to a; a zero vector
    has no direction and gives the identity.
    """
    a, b = _pair("a", a, 3, "b", b, 3)
    return _mapped(_between, 4, _scaled(a), _scaled(b))


def exponential(v: ArrayLike) -> FloatArray:
    """Return the rotations by |v| radians about v, (..., 3), as (..., 4)."""
    return _mapped(_exponential, 4, arguments.array("v", v, "...", 3))


def logarithm(q: ArrayLike) -> FloatArray:
    """Return the rotation vectors [rad], (..., 3), at most pi long, of rotations (..., 4)."""
    return _mapped(_logarithm, 3, unit("q", q))


def angle(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Return the geodesic angles [rad] between rotations a and b, (..., 4) each: 0 to pi."""
    a, b = arguments.together("b", unit("a", a), unit("b", b))
    return np.linalg.norm(logarithm(multiply(conjugate(a), b)), axis=-1)


def to_matrix(q: ArrayLike) -> FloatArray:
    """Return the rotation matrices, (..., 3, 3), of unit quaternions (..., 4)."""
    q = arguments.array("q", q, "...", 4)
    return np.swapaxes(rotate(q[..., None, :], np.eye(3)), -1, -2)


def roll_pitch_yaw(R: FloatArray) -> tuple[float, float, float]:
    """Return the angles about the fixed axes x, y and z whose rotations in turn make R [rad].

    Roll is read off after yaw is undone: it is exact also where pitch is a right angle.
    """
    yaw = math.atan2(R[1, 0], R[0, 0])
    sine, cosine = math.sin(yaw), math.cos(yaw)
    pitch = math.atan2(-R[2, 0], cosine * R[0, 0] + sine * R[1, 0])
    roll = math.atan2(sine * R[0, 2] - cosine * R[1, 2], cosine * R[1, 1] - sine * R[0, 1])
    return roll, pitch, yaw


def from_matrix(matrix: ArrayLike) -> FloatArray:
    """Return the unit quaternions, (..., 4), of matrices (..., 3, 3), rotations to 1e-6; w >= 0.

    The quaternion spans the top eigenspace of a symmetric 4 x 4 matrix linear in R
    (Bar-Itzhack 2000), which has no case of its own for any angle.
    """
    R = arguments.array("matrix", matrix, "...", 3, 3)
    defect = np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)).max(initial=0.0)
    if defect > UNIT_TOLERANCE or (np.linalg.det(R) < 0).any():
        raise ValueError(
            f"matrix: expected rotation matrices, got one with |R R^T - 1| = {defect:.3g} "
            f"or determinant -1"
        )
    q = np.linalg.eigh(_quaternion_form(R))[1][..., -1]
    return np.where(q[..., :1] < 0, -q, q)


def _quaternion_form(R: FloatArray) -> FloatArray:
    """Return K, (..., 4, 4), whose quadratic form q^T K q is largest at R's quaternion."""
    K = np.empty((*R.shape[:-2], 4, 4))
    K[..., 0, 0] = np.trace(R, axis1=-2, axis2=-1)
    K[..., 0, 1] = R[..., 2, 1] - R[..., 1, 2]
    K[..., 0, 2] = R[..., 0, 2] - R[..., 2, 0]
    K[..., 0, 3] = R[..., 1, 0] - R[..., 0, 1]
    K[..., 1:, 0] = K[..., 0, 1:]
    K[..., 1:, 1:] = R + np.swapaxes(R, -1, -2) - K[..., :1, :1] * np.eye(3)
    return K


def _scaled(v: FloatArray) -> FloatArray:
    """Return vectors times powers of two: no square underflows."""
    _, exponents = np.frexp(np.abs(v).max(axis=-1, keepdims=True))
    return np.ldexp(v, -exponents)


def _pair(
    first: str, a: ArrayLike, m: int, second: str, b: ArrayLike, n: int
) -> tuple[FloatArray, FloatArray]:
    """Return two named arguments, (..., m) and (..., n), with the same leading axes."""
    checked = arguments.array(first, a, "...", m), arguments.array(second, b, "...", n)
    return arguments.together(second, *checked)


def _parts(values: FloatArray) -> tuple[FloatArray, ...]:
    return tuple(np.moveaxis(values, -1, 0))


def _stack(parts: tuple[FloatArray, ...]) -> FloatArray:
    return np.stack(parts, axis=-1)


def _mapped(kernel: Kernel, width: int, *vectors: FloatArray) -> FloatArray:
    """Return the results of a kernel, (..., width), for rows of vectors."""
    result = np.empty((*vectors[0].shape[:-1], width))
    rows = [np.array(values.reshape(-1, values.shape[-1])) for values in vectors]
    kernel(*rows, result.reshape(-1, width))
    return result


def _between_rows(a, b, result):
    for i in range(a.shape[0]):
        store_quaternion(result, i, between_two(load_vector(a, i), load_vector(b, i)))


def _exponential_rows(v, result):
    for i in range(v.shape[0]):
        store_quaternion(result, i, exponential_of(load_vector(v, i)))


def _logarithm_rows(q, result):
    for i in range(q.shape[0]):
        store_vector(result, i, logarithm_of(load_quaternion(q, i)))


_between = Kernel(_between_rows)
_exponential = Kernel(_exponential_rows)
_logarithm = Kernel(_logarithm_rows)
