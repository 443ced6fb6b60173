"""Typed fields of records: the numbers of an experiment, and its settings, notes and facts.

An experiment declares its types in `values.py`, in `KINDS`. Records are read into these types: a
record with a missing field, or a field of another type, is refused.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar, get_args

import msgspec
import numpy as np

Floats1 = np.ndarray[tuple[int], np.dtype[np.float64]]
Floats2 = np.ndarray[tuple[int, int], np.dtype[np.float64]]
Floats3 = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
Integers1 = np.ndarray[tuple[int], np.dtype[np.int64]]
Booleans1 = np.ndarray[tuple[int], np.dtype[np.bool_]]

# The kinds of numbers for a field, by its own kind: integers may stand for floats.
_TAKES = {"f": "fiu", "i": "iu", "b": "b"}


class Values(msgspec.Struct, frozen=True, eq=False):
    """The numbers of a block: arrays with axes, and scalars.

    A None field is not on record. A name other than an identifier is given as
    `msgspec.field(name="cold wall")`.
    """


class Details(msgspec.Struct, frozen=True):
    """The settings, notes and facts of a block.

    Notes and facts of a measurement need a default, in case of failure.
    """


class Kind(NamedTuple):
    """The types of the records of a task."""

    values: type[Values]
    details: type[Details] = Details


Typed = TypeVar("Typed", bound=msgspec.Struct)


def read(kind: type[Typed], fields: Mapping[str, Any]) -> Typed:
    """Return fields, by their names on record, as a type; unknown fields are left out.

    Raises:
        ValueError: if a field is missing, or of another type or number of axes.
    """
    scalars = {
        name: field.item() if isinstance(field, np.ndarray) and not field.ndim else field
        for name, field in fields.items()
    }
    try:
        return msgspec.convert(scalars, kind, dec_hook=_array)
    except msgspec.ValidationError as error:
        raise ValueError(str(error).replace("$.", "")) from None


def stored(values: Values) -> dict[str, Any]:
    """Return values by their names on record, without None."""
    fields = msgspec.structs.fields(values)
    return {
        field.encode_name: number
        for field in fields
        if (number := getattr(values, field.name)) is not None
    }


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
