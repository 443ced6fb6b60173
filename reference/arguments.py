"""What a caller passed, checked: the array asked for, or a ValueError that names the argument."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

FLOAT64 = np.dtype(np.float64)

# The fourth power of a coordinate is still a finite number.
LARGEST_COORDINATE = 1e75


def array(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return a finite, C-contiguous, writable float64 array whose last axes are `trailing`.

    An int in `trailing` is a length, a word stands for any length; a leading "..." allows batch
    axes. The value itself is returned where it already fits, and must then not be written to.

    Raises:
        ValueError: if it is not numeric, has another shape, or holds NaN or infinity.
    """
    result = floats(name, value, *trailing)
    if not np.isfinite(result).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(result))[0])
        raise ValueError(f"{name}: expected finite numbers, got {result[where]} at index {where}")
    return result


def coordinates(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return the same as `array`, for lengths that will be squared and multiplied.

    Raises:
        ValueError: as `array` does, and if a coordinate is beyond 1e75.
    """
    return _bounded("coordinates", name, value, *trailing)


def magnitudes(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return the same as `coordinates`, for other quantities that are squared and multiplied.

    Raises:
        ValueError: as `array` does, and if a number is beyond 1e75.
    """
    return _bounded("numbers", name, value, *trailing)


def floats(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return the same as `array`, NaN and infinity let through, for kernels that look themselves.

    Raises:
        ValueError: if it is not numeric or has another shape.
    """
    result = _floats(name, value)
    if not _fits(result.shape, trailing):
        raise ValueError(f"{name}: expected shape {shape(trailing)}, got {shape(result.shape)}")
    return result


def number(name: str, value: Any, *, least: float = -np.inf, above: float = -np.inf) -> float:
    """Return a finite float, at least `least` and greater than `above`.

    Raises:
        ValueError: if it is not a finite number in that range.
    """
    if type(value) is float and least <= value < np.inf and value > above:
        return value
    if isinstance(value, str | bool):
        raise ValueError(f"{name}: expected a number, got {value!r}")
    result = _floats(name, value)
    if result.shape != ():
        raise ValueError(f"{name}: expected one number, got shape {shape(result.shape)}")
    if not np.isfinite(result):
        raise ValueError(f"{name}: expected a finite number, got {value}")
    if result <= above:
        raise ValueError(f"{name}: expected a number greater than {above:g}, got {value}")
    if result < least:
        raise ValueError(f"{name}: expected a number of at least {least:g}, got {value}")
    return float(result)


def integer(name: str, value: Any, *, least: int, below: int | None = None) -> int:
    """Return an int, at least `least` and, if given, less than `below`.

    Raises:
        ValueError: if it is not an integer (a boolean is none) in that range.
    """
    if type(value) is int and value >= least and (below is None or value < below):
        return value
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise ValueError(f"{name}: expected an integer, got {value!r}")
    if value < least or (below is not None and value >= below):
        upper = "" if below is None else f" and at most {below - 1}"
        raise ValueError(f"{name}: expected an integer of at least {least}{upper}, got {value}")
    return int(value)


def indices(
    name: str, value: ArrayLike, *trailing: int | str, least: int, below: int
) -> IndexArray:
    """Return a C-contiguous int64 array of indices, at least `least` and less than `below`.

    Raises:
        ValueError: if they are not integers (booleans are none), out of range, or of another shape.
    """
    given = np.asarray(value)
    if given.size == 0:
        given = given.astype(np.int64)
    if given.dtype.kind not in "iu":
        raise ValueError(f"{name}: expected integer indices, got {given.dtype} values")
    if not _fits(given.shape, trailing):
        raise ValueError(f"{name}: expected shape {shape(trailing)}, got {shape(given.shape)}")
    outside = (given < least) | (given >= below)
    if outside.any():
        raise ValueError(
            f"{name}: expected indices from {least} to {below - 1}, got {given[outside][0]}"
        )
    return np.array(given, dtype=np.int64, order="C")


def choice(name: str, value: Any, valid: Mapping[str, Any] | Sequence[str]) -> str:
    """Return the value if it is one of the valid names.

    Raises:
        ValueError: if not, with the valid names.
    """
    if not isinstance(value, str) or value not in valid:
        raise ValueError(f"{name}: expected one of {', '.join(valid)}, got {value!r}")
    return value


def spread(values: FloatArray, lengths: Sequence[int]) -> FloatArray:
    """Return the values broadcast to a shape, contiguous and writable, copied only if need be."""
    if values.shape == tuple(lengths):
        return values
    return np.array(np.broadcast_to(values, lengths), order="C")


def frozen(values: np.ndarray) -> np.ndarray:
    """Return a read-only view, for models and results to show."""
    view = values.view()
    view.setflags(write=False)
    return view


def shape(lengths: Sequence[int | str]) -> str:
    """Write a shape for an error message: (joint, 4)."""
    inner = ", ".join(str(length) for length in lengths)
    return f"({inner},)" if len(lengths) == 1 else f"({inner})"


def _bounded(kind: str, name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    result = floats(name, value, *trailing)
    largest = np.abs(result).max(initial=0.0)
    if not largest <= LARGEST_COORDINATE:
        array(name, result, *trailing)
        raise ValueError(
            f"{name}: expected {kind} of at most {LARGEST_COORDINATE:g}, got {largest:g}"
        )
    return result


def _floats(name: str, value: Any) -> FloatArray:
    if type(value) is np.ndarray and value.dtype == FLOAT64 and value.flags.carray:
        return value
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "fiu":
            raise TypeError
        return np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise ValueError(f"{name}: expected an array of numbers, got {value!r:.80}") from None


def _fits(actual: tuple[int, ...], trailing: tuple[int | str, ...]) -> bool:
    if trailing and trailing[0] == "...":
        trailing = trailing[1:]
        actual = actual[-len(trailing) :] if trailing else ()
    if actual == trailing:
        return True
    return len(actual) == len(trailing) and all(
        isinstance(n, str) or n == m for n, m in zip(trailing, actual, strict=True)
    )
