"""Functions of Python as a contestant, and what they may return."""

import inspect
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .case import Case
from .contestant import Answer, Failure, FailureKind, Functions
from .greeting import Greeting
from .sentence import Sentence, sentence
from .task import TASKS, Field, Task

_TYPES: Mapping[str, type] = {"number": np.float64, "integer": np.int64, "boolean": np.bool_}


class FunctionContestant:
    """Functions by the names of the tasks, called in this process: ours, an engine's, a fault's."""

    def __init__(self, functions: Functions, greeting: Greeting) -> None:
        self._functions = functions
        self._greeting = greeting

    @property
    def greeting(self) -> Greeting:
        """What is said of them."""
        return self._greeting

    def answer(self, case: Case) -> Answer | Failure:
        """Call the function of the case's task."""
        return call(self._functions[case.task], TASKS[case.task], case.inputs)

    def close(self) -> None:
        """Do nothing: there is no process."""


def call(function: Callable[..., Any], task: Task, inputs: Mapping[str, Any]) -> Answer | Failure:
    """Call a function with those inputs that it takes, as copies, and understand what it returns.

    What it raises is a failure; what it changes is a remark.
    """
    given = {
        name: np.array(value) if isinstance(value, np.ndarray) else value
        for name, value in inputs.items()
        if _takes(function, name)
    }
    start = time.perf_counter()
    try:
        returned = function(**given)
    except Exception as error:
        return Failure(
            FailureKind.RAISED,
            sentence("It raised {kind}: {why}", kind=type(error).__name__, why=str(error)[:200]),
        )
    seconds = time.perf_counter() - start
    try:
        values = understand(task, task.counts(inputs), returned)
    except ValueError as error:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=str(error)))
    return Answer(values, seconds, _changed(inputs, given))


def _takes(function: Callable[..., Any], name: str) -> bool:
    parameters = inspect.signature(function).parameters
    return name in parameters or any(
        one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters.values()
    )


def _changed(inputs: Mapping[str, Any], given: Mapping[str, Any]) -> tuple[Sentence, ...]:
    return tuple(
        sentence("It changed its argument {name}.", name=name)
        for name, value in given.items()
        if isinstance(value, np.ndarray) and not np.array_equal(value, inputs[name], equal_nan=True)
    )


def understand(task: Task, counts: Mapping[str, int], returned: object) -> dict[str, Any]:
    """Return the outputs by name.

    A dict is read by its keys, and those that are no outputs are left aside; a tuple by the order
    of the task's outputs, each value going to the next one of its shape; anything else as a tuple
    of one. Extents that the request does not fix may be any.

    Raises:
        ValueError: if nothing is understood, or an output has another shape or is no number.
    """
    if isinstance(returned, Mapping):
        known = [field for field in task.outputs if returned.get(field.name) is not None]
        values = {one.name: checked(one, counts, returned[one.name]) for one in known}
        found = "the keys " + ", ".join(map(str, returned))
    else:
        parts = list(returned) if isinstance(returned, tuple) else [returned]
        values = _by_shape(task, counts, parts)
        found = "; ".join(_describe(part) for part in parts)
    if not values:
        names = ", ".join(f"{one.name} {_shape(one.shape)}" for one in task.outputs)
        raise ValueError(f"{task.name}: expected some of {names}, got {found}")
    return values


def _by_shape(task: Task, counts: Mapping[str, int], parts: list[object]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    fields = iter(task.outputs)
    for part in parts:
        for field in fields:
            if _fits(field, counts, part):
                values[field.name] = checked(field, counts, part)
                break
    return values


def _fits(field: Field, counts: Mapping[str, int], value: object) -> bool:
    try:
        checked(field, counts, value)
    except ValueError:
        return False
    return True


def checked(field: Field, counts: Mapping[str, int], value: object) -> Any:
    """Return a value of a request or an answer as an array, a number or a text; null is NaN.

    Raises:
        ValueError: if its shape or its kind is another.
    """
    if field.kind == "text":
        if isinstance(value, str):
            return value
        raise ValueError(f"{field.name}: expected a text, got {_describe(value)}")
    array = _array(field, value)
    shape = tuple(counts.get(n, n) if isinstance(n, str) else n for n in field.shape)
    if len(shape) != array.ndim or any(
        isinstance(n, int) and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{field.name}: expected shape {_shape(shape)}, got {_describe(array)}")
    return array if shape else array.item()


def _array(field: Field, value: object) -> Any:
    kind = _TYPES[field.kind]
    try:
        array = np.asarray(value)
        if array.dtype == object:  # None among the numbers
            array = np.asarray(value, dtype=np.float64)
        if array.dtype.kind not in "biuf" or (
            field.kind != "number" and array.dtype.kind == "f" and not (array % 1 == 0).all()
        ):
            raise ValueError
        return np.array(array, dtype=kind)
    except (TypeError, ValueError):
        raise ValueError(
            f"{field.name}: expected {field.kind}s of shape {_shape(field.shape)}, "
            f"got {_describe(value)}"
        ) from None


def _shape(shape: tuple[str | int, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"


def _describe(value: object) -> str:
    if isinstance(value, np.ndarray):
        return _shape(value.shape)
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
