"""Typed fields of records: what an experiment measures, and what is said of it.

An experiment declares its types in `values.py`, in `KINDS`. What stands in the file of results is
read into them, so that a record that lacks a field, or has one of another type, is refused.
"""

import functools
import importlib
import importlib.util
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar, get_args

import msgspec
import numpy as np

Floats1 = np.ndarray[tuple[int], np.dtype[np.float64]]
Floats2 = np.ndarray[tuple[int, int], np.dtype[np.float64]]
Floats3 = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
Integers1 = np.ndarray[tuple[int], np.dtype[np.int64]]
Booleans1 = np.ndarray[tuple[int], np.dtype[np.bool_]]

# Which kinds of numbers a field takes, by its own kind: whole numbers may stand for others.
_TAKES = {"f": "fiu", "i": "iu", "b": "b"}


class Values(msgspec.Struct, frozen=True, eq=False):
    """What a block measured: arrays of one axis or more, and single numbers.

    A field that is None is not on record. A name that is no identifier is given as
    `msgspec.field(name="cold wall")`.
    """


class Details(msgspec.Struct, frozen=True):
    """What is said of a block: its settings, its notes, and its facts.

    What a measurement says, and not its block, needs a default, since it may fail.
    """


class Kind(NamedTuple):
    """The types of the records of one task of a suite."""

    values: type[Values]
    details: type[Details] = Details


@functools.cache
def kind_of(suite: str, task: str) -> Kind | None:
    """Return the types of the records of a task ("" if they name none); None of other suites.

    No engine is imported.

    Raises:
        ValueError: if the suite has no such task.
    """
    from .experiment import EXPERIMENTS

    modules = [f"{made.package}.values" for made in EXPERIMENTS if made.suite == suite]
    declared = list(filter(importlib.util.find_spec, modules))
    kinds = {name: kind for module in declared
             for name, kind in importlib.import_module(module).KINDS.items()}  # fmt: skip
    if modules == declared and modules and task not in kinds:
        raise ValueError(f"task: expected one of {', '.join(map(repr, kinds))}, got {task[:40]!r}")
    return kinds.get(task)


Typed = TypeVar("Typed", bound=msgspec.Struct)


def read(kind: type[Typed], fields: Mapping[str, Any]) -> Typed:
    """Return fields, by the names they have on record, as a type; more of them are left out.

    Raises:
        ValueError: if there is no such field, or it is of another type or number of axes.
    """
    known = {name: _single(value) for name, value in fields.items()}
    try:
        return msgspec.convert(known, kind, dec_hook=_array)
    except msgspec.ValidationError as error:
        raise ValueError(str(error).replace("$.", "")) from None


def stored(values: Values) -> dict[str, Any]:
    """Return values by the names they have on record, without those that are None."""
    fields = msgspec.structs.fields(values)
    every = {field.encode_name: getattr(values, field.name) for field in fields}
    return {name: value for name, value in every.items() if value is not None}


def _single(value: Any) -> Any:
    """Return an array without axes as a number."""
    return value.item() if isinstance(value, np.ndarray) and not value.ndim else value


def _array(kind: Any, value: Any) -> np.ndarray:
    """Return an array of the kind; nothing at all is of every type."""
    shape, dtype = get_args(kind)
    axes, wanted = len(get_args(shape)), np.dtype(get_args(dtype)[0])
    array = np.asarray(value)
    if not array.size:
        return np.empty((0,) * axes, wanted)
    if array.ndim != axes:
        raise ValueError(f"expected {axes} dimensions, got {array.ndim}")
    if array.dtype.kind not in _TAKES[wanted.kind]:
        raise ValueError(f"expected {wanted.name}, got {array.dtype.name}")
    return array.astype(wanted, copy=False)
