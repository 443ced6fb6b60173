"""Checks of arguments: return the value, or raise a ValueError that names the argument.

One rule bounds all magnitudes: no number is beyond 1e75, and a size, which is a number that may not
be negative, is 0 or at least 1e-75. The fourth powers of all numbers, and the quotients by those of
sizes, are then finite. `array`, `sizes` and `number` keep the rule; only a caller that checks the
numbers itself, a kernel say, may take them from `floats`. A boolean is no number and no integer.
"""

import copy
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
RecordArray = NDArray[np.void]
Kind = TypeVar("Kind")

FLOAT64 = np.dtype(np.float64)

# The largest number and the smallest size but 0.
LARGEST_COORDINATE, SMALLEST_POSITIVE = 1e75, 1e-75
# The largest number of particles, joints, points, poses or restarts: arrays of more fit no memory.
LARGEST_COUNT = 10**8
# Error messages show no arrays of more numbers.
LARGEST_SHOWN = 1000
# The largest integer of the arrays of indices, and of the kernels.
LARGEST_INTEGER = 2**63 - 1


def array(name: str, value: ArrayLike, *trailing: int | str, kind: str = "numbers") -> FloatArray:
    """Return a finite, C-contiguous, writable float64 array with `trailing` as its last axes.

    An int in `trailing` is a length, a word stands for any length; a leading "..." allows batch
    axes. A value that fits already is returned itself, and must then not be written to.
    """
    result = floats(name, value, *trailing)
    largest = np.abs(result).max(initial=0.0)
    if largest <= LARGEST_COORDINATE:
        return result
    if not np.isfinite(result).all():
        index = tuple(np.argwhere(~np.isfinite(result))[0].tolist())
        raise ValueError(f"{name}: expected finite numbers, got {result[index]} at index {index}")
    number, bound = distinct_texts(largest, LARGEST_COORDINATE)
    raise ValueError(f"{name}: expected {kind} of at most {bound}, got {number}")


def coordinates(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return the same as `array`; the error speaks of coordinates."""
    return array(name, value, *trailing, kind="coordinates")


def sizes(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return the same as `array`, of sizes: masses, lengths, stiffnesses."""
    result = array(name, value, *trailing)
    wrong = np.flatnonzero((result < SMALLEST_POSITIVE) & (result != 0.0))
    if len(wrong):
        size = result.flat[wrong[0]]
        expected = "none below 0" if size < 0.0 else f"0 or at least {SMALLEST_POSITIVE:g}"
        raise ValueError(f"{name}: expected {expected}, got {size} at index {wrong[0]}")
    return result


def floats(name: str, value: ArrayLike, *trailing: int | str) -> FloatArray:
    """Return the same as `array` without a check of the numbers, for kernels that check them."""
    if type(value) is np.ndarray and value.dtype == FLOAT64 and value.flags.carray:
        if not _fits(value.shape, trailing):
            check_shape(name, value, *trailing)
        return value
    numbers = _converted(name, value)
    if numbers.dtype.kind not in "fiu":
        got = f"{value.dtype} values" if isinstance(value, np.ndarray) else shown(value)
        raise ValueError(f"{name}: expected an array of numbers, got {got}")
    check_shape(name, numbers, *trailing)
    return np.array(numbers, dtype=np.float64, order="C")


def is_plain(values: Any, shape: tuple[int, ...]) -> bool:
    """Return whether values are a float64 array of a shape that kernels take as it is."""
    return (
        type(values) is np.ndarray
        and values.dtype == FLOAT64
        and values.shape == shape
        and values.flags.carray
    )


def output(name: str, value: Any, lengths: tuple[int, ...]) -> FloatArray:
    """Return an array for results: a new array for None, else the value if kernels can fill it."""
    if value is None or is_plain(value, lengths):
        return np.empty(lengths) if value is None else value
    got = shown(value)
    if isinstance(value, np.ndarray):
        access, kind = "" if value.flags.writeable else "read-only ", type(value).__name__
        got = f"a {access}{kind} of {value.dtype}, {shape(value.shape)}, strides {value.strides}"
    expected = f"a writable, C-contiguous float64 array of shape {shape(lengths)}"
    raise ValueError(f"{name}: expected {expected}, got {got}")


def number(
    name: str, value: Any, *, minimum: float = -LARGEST_COORDINATE, above: float = -np.inf
) -> float:
    """Return a finite float, at least `minimum`, greater than `above`, and at most 1e75.

    If the range has no negative numbers it is a size: 0, where that is in the range, or at least
    1e-75.
    """
    is_size = max(minimum, above) >= 0.0
    lowest = max(minimum, SMALLEST_POSITIVE) if is_size else minimum  # of numbers other than 0
    if type(value) is float and lowest <= value <= LARGEST_COORDINATE and value > above:
        return value
    if isinstance(value, str | bool):
        raise ValueError(f"{name}: expected a number, got {shown(value)}")
    result = floats(name, value, "...")
    if result.shape != ():
        raise ValueError(f"{name}: expected one number, got shape {shape(result.shape)}")
    zero = "0 or " if minimum == 0.0 > above else ""
    for is_wrong, expected in (
        (not np.isfinite(result), "a finite number"),
        (result <= above, f"a number greater than {above:g}"),
        (result < minimum, f"a number of at least {minimum:g}"),
        (result < lowest and result != 0.0, f"{zero}a number of at least {lowest:g}"),
        (result > LARGEST_COORDINATE, f"a number of at most {LARGEST_COORDINATE:g}"),
    ):
        if is_wrong:
            raise ValueError(f"{name}: expected {expected}, got {value}")
    return float(result)


def integer(name: str, value: Any, *, minimum: int, below: int = LARGEST_INTEGER + 1) -> int:
    """Return an int, at least `minimum` and less than `below`."""
    if type(value) is int and minimum <= value < below:
        return value
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | np.integer):
        raise ValueError(f"{name}: expected an integer, got {shown(value)}")
    if not minimum <= value < below:
        upper = "" if below > LARGEST_INTEGER >= value else f" and at most {below - 1}"
        raise ValueError(f"{name}: expected an integer of at least {minimum}{upper}, got {value}")
    return int(value)


def count(name: str, value: Any, *, minimum: int) -> int:
    """Return an int, at least `minimum` and at most LARGEST_COUNT: a length of arrays."""
    result = integer(name, value, minimum=minimum)
    if result > LARGEST_COUNT:
        raise ValueError(f"{name}: expected at most {LARGEST_COUNT:,}, got {result}")
    return result


def lengths(name: str, value: Sequence[Any]) -> tuple[int, ...]:
    """Return the leading axes of an array, 0 or more."""
    return tuple(count(name, length, minimum=0) for length in value)


def indices(
    name: str, value: ArrayLike, *trailing: int | str, minimum: int, below: int
) -> IndexArray:
    """Return a C-contiguous int64 array of indices, at least `minimum` and less than `below`."""
    integers = _converted(name, value)
    if integers.dtype.kind not in ("iu" if integers.size else "iuf"):  # an empty list is of floats
        raise ValueError(f"{name}: expected integer indices, got {integers.dtype} values")
    check_shape(name, integers, *trailing)
    result = np.array(integers, dtype=np.int64, order="C")
    outside = integers[(result < minimum) | (result >= below)]
    if outside.size:
        raise ValueError(
            f"{name}: expected indices from {minimum} to {below - 1}, got {outside[0]}"
        )
    return result


def flags(name: str, value: ArrayLike, count: int) -> BoolArray:
    """Return booleans, shape (count,), spread where a single boolean stands for all."""
    booleans = _converted(name, value)
    if booleans.dtype != bool:
        raise ValueError(f"{name}: expected booleans, got {booleans.dtype} values")
    if booleans.shape != ():
        check_shape(name, booleans, count)
    return np.array(np.broadcast_to(booleans, (count,)))


def boolean(name: str, value: Any) -> bool:
    """Return a boolean; a number is none."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name}: expected True or False, got {shown(value)}")
    return bool(value)


def text(name: str, value: Any) -> str:
    """Return a string."""
    if not isinstance(value, str):
        raise ValueError(f"{name}: expected text, got {shown(value)}")
    return value


def sequence(name: str, value: Any, count: int, owner: str) -> tuple[Any, ...]:
    """Return a sequence of `count` elements as a tuple; `owner` of an element is for the error."""
    is_list = isinstance(value, Sequence) and not isinstance(value, str | bytes)
    is_sequence = is_list or (isinstance(value, np.ndarray) and value.ndim > 0)
    if not is_sequence or len(value) != count:
        got = len(value) if is_sequence else shown(value)
        raise ValueError(f"{name}: expected {count} {name}, one {owner}, got {got}")
    return tuple(value)


def choice(name: str, value: Any, valid: Mapping[str, Any] | Sequence[str]) -> str:
    """Return the value if it is a valid name."""
    if not isinstance(value, str) or value not in valid:
        raise ValueError(f"{name}: expected one of {name_list(valid)}, got {shown(value)}")
    return value


def name_list(names: Iterable[str]) -> str:
    """Return names with commas between them, all quoted if any has a comma of its own."""
    texts = list(names)
    return ", ".join(map(repr, texts) if any("," in text for text in texts) else texts)


def instance(name: str, value: Any, kind: type[Kind]) -> Kind:
    """Return the value if it is of a kind."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOUaeiou" else "a"
        raise ValueError(f"{name}: expected {article} {kind.__name__}, got {type(value).__name__}")
    return value


def broadcast(
    name: str, first: tuple[int, ...], second: tuple[int, ...], owner: str = ""
) -> tuple[int, ...]:
    """Return two batches' common leading axes.

    In the error, `name` is the argument of the second and `owner` is that of the first.
    """
    try:
        return np.broadcast_shapes(first, second)
    except ValueError:
        expected = f"leading axes that broadcast with {owner}{shape(first)}"
        raise ValueError(f"{name}: expected {expected}, got {shape(second)}") from None


def together(name: str, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return both with the same leading axes but the last; `name` is the second's argument."""
    batch = broadcast(name, a.shape[:-1], b.shape[:-1])
    return spread(a, (*batch, a.shape[-1])), spread(b, (*batch, b.shape[-1]))


def check_shape(name: str, values: np.ndarray, *trailing: int | str) -> None:
    """Raise a ValueError that names the argument if its shape is not as for `array`."""
    if not _fits(values.shape, trailing):
        raise ValueError(f"{name}: expected shape {shape(trailing)}, got {shape(values.shape)}")


def spread(values: FloatArray, lengths: Sequence[int]) -> FloatArray:
    """Return the values broadcast to a shape, contiguous and writable, copied only if need be."""
    if values.shape == tuple(lengths):
        return values
    return np.array(np.broadcast_to(values, lengths), order="C")


def frozen(values: np.ndarray) -> np.ndarray:
    """Return a read-only view, for the attributes of models and results."""
    view = values.view()
    view.setflags(write=False)
    return view


class KeepsReadOnly:
    """A model with read-only arrays, also in copies and pickles."""

    def __getstate__(self) -> tuple[dict[str, Any], list[str]]:
        values = vars(self)
        arrays = [name for name, value in values.items() if isinstance(value, np.ndarray)]
        return values, [name for name in arrays if not values[name].flags.writeable]

    def __setstate__(self, state: tuple[dict[str, Any], list[str]]) -> None:
        values, names = state
        self.__dict__.update(values, **{name: frozen(values[name]) for name in names})


def snapshot(value: Any) -> Any:
    """Return a copy of an array or a list, safe from later changes; else the value."""
    return copy.deepcopy(value) if isinstance(value, np.ndarray | list) else value


def shape(lengths: Sequence[int | str]) -> str:
    """Write a shape for an error message: (joint, 4)."""
    inner = ", ".join(str(length) for length in lengths)
    return f"({inner},)" if len(lengths) == 1 else f"({inner})"


def shown(value: Any) -> str:
    """Write a value for an error message, in short.

    Large arrays are not written: NumPy takes half a minute to shorten an array of 20 axes.
    """
    parts = value if isinstance(value, list | tuple) else (value,)
    if any(isinstance(part, np.ndarray) and part.size > LARGEST_SHOWN for part in parts):
        kind = type(value).__name__
        return f"an array of shape {shape(value.shape)}" if kind == "ndarray" else f"a {kind}"
    return f"{value!r:.80}"


def digits_apart(number: float, bound: float, minimum: int = 6) -> int:
    """Return the fewest significant digits, at least `minimum`, by which two numbers differ."""
    counts = (
        digits for digits in range(minimum, 17) if f"{number:.{digits}g}" != f"{bound:.{digits}g}"
    )
    return next(counts, 17)


def distinct_texts(number: float, bound: float, minimum: int = 6) -> tuple[str, str]:
    """Write a number and its bound, for a message, with as many digits as tell them apart."""
    digits = digits_apart(number, bound, minimum)
    return f"{number:.{digits}g}", f"{bound:.{digits}g}"


def _converted(name: str, value: Any) -> np.ndarray:
    """Return the value as an array of any type, a view of an array."""
    try:
        values = np.asarray(value)
    except Exception:  # an object's own conversion may raise any error
        raise ValueError(f"{name}: expected an array of numbers, got {shown(value)}") from None
    if np.ma.is_masked(value):
        raise ValueError(f"{name}: expected an array of numbers, got one with masked values")
    return values


def _fits(actual: tuple[int, ...], trailing: tuple[int | str, ...]) -> bool:
    if trailing and trailing[0] == "...":
        trailing = trailing[1:]
        actual = actual[-len(trailing) :] if trailing else ()
    if actual == trailing:
        return True
    return len(actual) == len(trailing) and all(
        isinstance(n, str) or n == m for n, m in zip(trailing, actual, strict=True)
    )
