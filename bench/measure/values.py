"""Typed values of records: an experiment declares one type for the records of each of its tasks.

Settings and measured values are read into the type. A record with a missing field, or a field of
another type, is refused.
"""

import functools
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypeVar, cast, get_args

import msgspec
import numpy as np

Floats1 = np.ndarray[tuple[int], np.dtype[np.float64]]
Floats2 = np.ndarray[tuple[int, int], np.dtype[np.float64]]
Floats3 = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
Integers1 = np.ndarray[tuple[int], np.dtype[np.int64]]
Booleans1 = np.ndarray[tuple[int], np.dtype[np.bool_]]

Entry = TypeVar("Entry")
# A field that is no number of the measurement: a setting, a word, a condition.
Fact = Annotated[Entry, "fact"]

# The kinds of numbers for a field, by its own kind: integers may stand for floats.
_TAKES = {"f": "fiu", "i": "iu", "b": "b"}


class Values(msgspec.Struct, frozen=True, eq=False, kw_only=True):
    """The settings and measured values of a block: words, numbers, and arrays with axes.

    A record without numbers, as of a solver that is not installed, has facts only. A None field is
    not on record.
    """

    title: str = ""  # of the problem, as written
    task: str = ""  # the kind of the numbers among the kinds of a suite
    remark: str = ""  # on the numbers, or why there are none
    failed: str = ""  # the exception of a measurement without a result
    trouble: str = ""  # the most frequent exception of the solver, with its count
    entrant: bool = False  # whether a user entered the solver
    door: str = ""  # how the user's solver is reached
    digest: str = ""  # of the files of the user's solver
    problem_digest: str = ""  # of a user's problem, or the seed of its targets
    first_targets: int | None = None  # so many of the first targets only, for a slow solver


Typed = TypeVar("Typed", bound=msgspec.Struct)


def read(kind: type[Typed], fields: Mapping[str, Any]) -> Typed:
    """Return fields, by their names on record, as a type; unknown fields are left out.

    Raises:
        ValueError: if a field is missing, or of another type or number of axes.
    """
    scalars = {
        name: field.item()
        if isinstance(field, np.ndarray | np.generic) and not field.ndim
        else field
        for name, field in fields.items()
    }
    try:
        return msgspec.convert(scalars, kind, dec_hook=_array)
    except msgspec.ValidationError as error:
        raise ValueError(str(error).replace("$.", "")) from None


@functools.cache
def number_names(kind: type[Values]) -> frozenset[str]:
    """Return the names of the fields of a type that are no facts."""
    facts = {field.name for field in msgspec.structs.fields(kind) if "fact" in get_args(field.type)}
    return _names(kind) - _names(Values) - facts


@functools.cache
def array_names(kind: type[Values]) -> frozenset[str]:
    """Return the names of the fields that hold arrays."""
    fields = msgspec.structs.fields(kind)
    return frozenset(f.name for f in fields if np.ndarray.__name__ in str(f.type))


@functools.cache
def facts_of(kind: type[Values]) -> type[Values]:
    """Return the type of the facts of a block alone."""
    left_out, field = number_names(kind) | _names(Values), cast(Any, msgspec.field)
    facts = [
        (f.name, f.type, field(default=f.default, default_factory=f.default_factory))
        for f in msgspec.structs.fields(kind)
        if f.name not in left_out
    ]
    facts_only = msgspec.defstruct(kind.__name__, facts, bases=(Values,), frozen=True, kw_only=True)
    return cast(type[Values], facts_only)


@functools.cache
def _names(kind: type[Values]) -> frozenset[str]:
    return frozenset(field.name for field in msgspec.structs.fields(kind))


def check_names(kind: type[Values], measured: Iterable[str]) -> None:
    """Check that all names of measured values are declared.

    Raises:
        ValueError: naming those that are not, such as a misspelt one.
    """
    if unknown := sorted({*measured} - _names(kind)):
        expected = f"expected values that {kind.__name__} declares"
        raise ValueError(f"measured: {expected}, got {', '.join(unknown)[:100]}")


def _array(kind: Any, nested: Any) -> np.ndarray:
    """Return an array of the kind; an empty array is of every type."""
    shape, dtype = get_args(kind)
    axes, expected = len(get_args(shape)), np.dtype(get_args(dtype)[0])
    array = np.asarray(nested)
    if not array.size:
        return np.empty((0,) * axes, expected)
    if array.ndim != axes:
        raise ValueError(f"expected {axes} dimensions, got {array.ndim}")
    if array.dtype.kind not in _TAKES[expected.kind]:
        raise ValueError(f"expected {expected.name}, got {array.dtype.name}")
    return array.astype(expected, copy=False)
