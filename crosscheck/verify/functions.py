"""Functions of Python as a contestant, and what they may return."""

import contextlib
import inspect
import reprlib
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter  # before a solver is loaded, which may replace `time.perf_counter`
from typing import Any

import numpy as np

from .case import Case
from .contestant import Answer, Failure, FailureKind, Functions
from .greeting import Greeting
from .sentence import Sentence, did_you_mean, sentence
from .task import TASKS, Field, Task

# The most points of an answer whose number the request leaves open: no case needs a tenth of them,
# and the judge looks at each.
MOST_POINTS = 1000
_TYPES: Mapping[str, type] = {"number": np.float64, "integer": np.int64, "boolean": np.bool_}


class FunctionContestant:
    """Functions called in this process: ours, an engine's, a fault's.

    Each has the name of a task, or of a method of inverse kinematics.
    """

    remarks: tuple[Sentence, ...] = ()

    def __init__(self, functions: Functions, greeting: Greeting) -> None:
        self._functions = functions
        self._greeting = greeting

    @property
    def greeting(self) -> Greeting:
        """What is said of them."""
        return self._greeting

    def answer(self, case: Case) -> Answer | Failure:
        """Call the function of the case's method if there is one, else that of its task."""
        method = self._functions.get(case.inputs.get("method", ""))
        return call(method or self._functions[case.task], TASKS[case.task], case.inputs)

    def close(self) -> None:
        """Do nothing: there is no process."""


def call(function: Callable[..., Any], task: Task, inputs: Mapping[str, Any]) -> Answer | Failure:
    """Call a function with those inputs that it takes, as copies, and understand what it returns.

    What it raises is a failure; what it changes is a remark.
    """
    if why := _missing_input(function, task, inputs):
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=why))
    given = {
        name: np.array(value) if isinstance(value, np.ndarray) else value
        for name, value in inputs.items()
        if takes(function, name)
    }
    start = perf_counter()
    try:
        returned = function(**given)
    except (Exception, SystemExit) as error:
        return describe_exception(error, _file(function))
    seconds = perf_counter() - start
    try:
        values = understand(task, inputs, returned)
    except ValueError as error:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=str(error)))
    return Answer(values, seconds, _changed(inputs, given))


def _parameters(function: Callable[..., Any]) -> list[inspect.Parameter] | None:
    """Return the parameters of a function, None of compiled code that does not say them."""
    try:
        return list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return None


def takes(function: Callable[..., Any], name: str) -> bool:
    """Return whether a function takes an argument, as those that do not say so are taken to do."""
    parameters = _parameters(function)
    return parameters is None or any(
        one.name == name or one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters
    )


def _missing_input(function: Callable[..., Any], task: Task, inputs: Mapping[str, Any]) -> str:
    """Return what is wrong with arguments that a function needs and no input has the name of."""
    variadic = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    missing = [
        one.name
        for one in _parameters(function) or ()
        if one.kind not in variadic and one.default is one.empty and one.name not in inputs
    ]
    optional = [name for name in missing if name in {field.name for field in task.inputs}]
    if optional:
        return f"{optional[0]} is not given in every request: give it a default"
    if not missing:
        return ""
    hint = did_you_mean(missing[0], inputs)
    return f"no input is called {', '.join(missing)}{hint or ':'} There are {', '.join(inputs)}"


def _file(function: Callable[..., Any]) -> str:
    return getattr(getattr(inspect.unwrap(function), "__code__", None), "co_filename", "")


def describe_exception(error: BaseException, file: str) -> Failure:
    """Return the failure of code that raised, with the last line in the folder of its file."""
    why = " ".join(str(error).split())[:200]
    kind = type(error).__name__
    if isinstance(error, SyntaxError) and error.filename:
        return raised(kind, error.msg, Path(error.filename).name, error.lineno or 0)
    for frame in reversed(traceback.extract_tb(error.__traceback__) if file else []):
        if frame.filename == file or is_beside(Path(frame.filename), Path(file)):
            return raised(kind, why, Path(frame.filename).name, frame.lineno or 0)
    return raised(kind, why)


def is_beside(path: Path, file: Path) -> bool:
    """Return whether a file is of the same folder as another, and not ours or a library's."""
    ours = Path(__file__).parent in path.parents
    return file.parent in path.parents and not ours and "site-packages" not in path.parts


def raised(kind: str, why: str, file: str = "", line: int = 0) -> Failure:
    """Return the failure of code that raised an exception, in a line of a file if that is known."""
    words = sentence(
        "It raised {kind} in line {line} of {file}: {why}"
        if file and line
        else "It raised {kind}: {why}",
        kind=kind, line=line, file=file, why=why,
    )  # fmt: skip
    return Failure(FailureKind.RAISED, words)


def _changed(inputs: Mapping[str, Any], given: Mapping[str, Any]) -> tuple[Sentence, ...]:
    return tuple(
        sentence("It changed its argument {name}.", name=name)
        for name, value in given.items()
        if isinstance(value, np.ndarray) and not np.array_equal(value, inputs[name], equal_nan=True)
    )


def understand(task: Task, inputs: Mapping[str, Any], returned: object) -> dict[str, Any]:
    """Return the outputs by name.

    A dict is read by its keys, and those that are no outputs are left aside; a tuple by the order
    of the task's outputs, each value going to the next one of its shape; anything else as a tuple
    of one. Extents that the request does not fix may be up to `MOST_POINTS`.

    Raises:
        ValueError: if nothing is understood, an output has another shape or is no number, or there
            are more iterations than the request allows.
    """
    counts = task.counts(inputs)
    if isinstance(returned, Mapping):
        fields = [field for field in task.outputs if returned.get(field.name) is not None]
        values = {one.name: checked(one, counts, returned[one.name]) for one in fields}
        came = f"the keys {', '.join(map(str, returned))}" if returned else "an empty dict"
    else:
        parts = list(returned) if isinstance(returned, tuple) else [returned]
        values = {} if returned is None else _by_shape(task, counts, parts)
        came = "; ".join(map(_describe, parts))
    if not values:
        names = ", ".join(f"{one.name} {_shape(one.shape)}" for one in task.outputs)
        raise ValueError(f"{task.name}: expected some of {names}, got {came}")
    for field in task.outputs:
        is_open = any(isinstance(n, str) and n not in counts for n in field.shape)
        if is_open and field.name in values and (size := len(values[field.name])) > MOST_POINTS:
            raise ValueError(f"{field.name}: expected at most {MOST_POINTS} rows, got {size}")
    count, limit = values.get("iterations", 0), inputs.get("max_iterations", np.inf)
    if not 0 <= count <= limit:
        raise ValueError(f"iterations: expected 0 to {limit}, the max_iterations sent, got {count}")
    return values


def _by_shape(task: Task, counts: Mapping[str, int], parts: list[object]) -> dict[str, Any]:
    """Return each part as the next output of its shape."""
    values: dict[str, Any] = {}
    fields = iter(task.outputs)
    for part in parts:
        for field in fields:
            with contextlib.suppress(ValueError):
                values[field.name] = checked(field, counts, part)
                break
    return values


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
    if array.size == 0 and array.ndim < len(shape):  # nested lists do not say what they lack
        array = array.reshape([0, *(n if isinstance(n, int) else 0 for n in shape[1:])])
    if len(shape) != array.ndim or any(
        isinstance(n, int) and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{field.name}: expected shape {_shape(shape)}, got {_describe(array)}")
    return array if shape else array.item()


def _array(field: Field, value: object) -> Any:
    kind = _TYPES[field.kind]
    try:
        if _holds_text(value):  # of which NumPy makes an array as wide as the longest one
            raise ValueError
        array = np.asarray(value)
        if array.dtype == object:  # None among the numbers
            array = np.asarray(value, dtype=np.float64)
        if array.dtype.kind not in "biuf" or (field.kind != "number" and not _whole(array)):
            raise ValueError
        return np.array(array, dtype=kind)
    except (TypeError, ValueError, OverflowError, RecursionError):
        shape = f"{field.kind}s of shape {_shape(field.shape)}"
        expected = shape if field.shape else f"one {field.kind}"
        got = f"{value.dtype} values of shape " if isinstance(value, np.ndarray) else ""
        raise ValueError(
            f"{field.name}: expected {expected}, got {got}{_describe(value)}"
        ) from None


def _holds_text(value: object) -> bool:
    return isinstance(value, str) or (
        isinstance(value, list | tuple) and any(map(_holds_text, value))
    )


def _whole(array: Any) -> bool:
    """Return whether all are integers that 64 bits hold."""
    if array.dtype.kind in "biu":
        return array.dtype != np.uint64 or not (array > np.iinfo(np.int64).max).any()
    return bool(((np.abs(array) < 2.0**62) & (np.floor(array) == array)).all())


def _shape(shape: tuple[str | int, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"


def _describe(value: object) -> str:
    if isinstance(value, np.ndarray):
        return _shape(value.shape)
    try:
        text = reprlib.repr(value)
    except ValueError:  # of an integer of thousands of digits
        return f"a {type(value).__name__} too long to show"
    return text if len(text) <= 60 else f"{text[:57]}..."
