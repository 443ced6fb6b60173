"""Functions of Python as a connection, and their returned values."""

import contextlib
import inspect
import reprlib
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import perf_counter  # before a solver is loaded, which may replace `time.perf_counter`
from typing import Any

import numpy as np

from plumbob.text.sentence import Sentence, did_you_mean, sentence

from .case import Case
from .exchange import Answer, Failure, FailureKind, Functions
from .greeting import Greeting
from .task import TASKS, Field, Task

# The limit of points where a request leaves their number open: no case needs a tenth, and the judge
# looks at each point.
MOST_POINTS = 1000
_TYPES: Mapping[str, type] = {"number": np.float64, "integer": np.int64, "boolean": np.bool_}


class FunctionConnection:
    """Functions called in this process, by the names of tasks or methods of inverse kinematics."""

    remarks: tuple[Sentence, ...] = ()

    def __init__(self, functions: Functions, greeting: Greeting) -> None:
        self._functions = functions
        self.greeting = greeting

    def answer(self, case: Case) -> Answer | Failure:
        """Call the function of the case's method if any, else the function of its task."""
        method = self._functions.get(case.inputs.get("method", ""))
        return call(method or self._functions[case.task], TASKS[case.task], case.inputs)

    def close(self) -> None:
        """Do nothing: there is no process."""


def call(function: Callable[..., Any], task: Task, inputs: Mapping[str, Any]) -> Answer | Failure:
    """Call a function with copies of its inputs; exceptions are failures, changes are remarks."""
    parameters = _parameters(function)
    if reason := _missing_input(parameters or (), task, inputs):
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=reason))
    arguments = {
        name: np.array(value) if isinstance(value, np.ndarray) else value
        for name, value in inputs.items()
        if _is_taken(name, parameters)
    }
    start = perf_counter()
    try:
        returned = function(**arguments)
    except (Exception, SystemExit) as error:
        code = getattr(inspect.unwrap(function), "__code__", None)
        return describe_exception(error, getattr(code, "co_filename", ""))
    seconds = perf_counter() - start
    try:
        outputs = understand(task, inputs, returned)
    except ValueError as error:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=str(error)))
    remarks = tuple(
        sentence("It changed its argument {name}.", name=name)
        for name, array in arguments.items()
        if isinstance(array, np.ndarray) and not np.array_equal(array, inputs[name], equal_nan=True)
    )
    return Answer(outputs, seconds, remarks)


def _parameters(function: Callable[..., Any]) -> list[inspect.Parameter] | None:
    """Return the parameters of a function, None of compiled code without a signature."""
    try:
        return list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return None


def takes(function: Callable[..., Any], name: str) -> bool:
    """Return whether a function takes an argument, True of compiled code without a signature."""
    return _is_taken(name, _parameters(function))


def _is_taken(name: str, parameters: Sequence[inspect.Parameter] | None) -> bool:
    return parameters is None or any(
        parameter.name == name or parameter.kind is inspect.Parameter.VAR_KEYWORD
        for parameter in parameters
    )


def _missing_input(
    parameters: Sequence[inspect.Parameter], task: Task, inputs: Mapping[str, Any]
) -> str:
    """Return an error if the inputs lack an argument of a function, else ""."""
    variadic = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    missing = [
        parameter.name
        for parameter in parameters
        if parameter.kind not in variadic
        and parameter.default is parameter.empty
        and parameter.name not in inputs
    ]
    optional = [name for name in missing if name in {field.name for field in task.inputs}]
    if optional:
        return f"{optional[0]} is not given in every request: give it a default"
    if not missing:
        return ""
    hint = did_you_mean(missing[0], inputs)
    return f"no input is called {', '.join(missing)}{hint or ':'} There are {', '.join(inputs)}"


def describe_exception(error: BaseException, file: str) -> Failure:
    """Return the failure of an exception, with the last line in the folder of the code's file."""
    reason = " ".join(str(error).split())[:200]
    kind = type(error).__name__
    if isinstance(error, SyntaxError) and error.filename:
        return raised(kind, error.msg, Path(error.filename).name, error.lineno or 0)
    for frame in reversed(traceback.extract_tb(error.__traceback__) if file else []):
        if frame.filename == file or is_beside(Path(frame.filename), Path(file)):
            return raised(kind, reason, Path(frame.filename).name, frame.lineno or 0)
    return raised(kind, reason)


def is_beside(path: Path, file: Path) -> bool:
    """Return whether a path is in the folder of a file, and not ours or a library's."""
    is_ours = Path(__file__).parent in path.parents
    return file.parent in path.parents and not is_ours and "site-packages" not in path.parts


def raised(kind: str, why: str, file: str = "", line: int = 0) -> Failure:
    """Return the failure of an exception, with its file and line if known."""
    message = sentence(
        "It raised {kind} in line {line} of {file}: {why}"
        if file and line
        else "It raised {kind}: {why}",
        kind=kind, line=line, file=file, why=why,
    )  # fmt: skip
    return Failure(FailureKind.RAISED, message)


def understand(task: Task, inputs: Mapping[str, Any], returned: object) -> dict[str, Any]:
    """Return the outputs by name.

    The keys of a dict name outputs; other keys are ignored. The parts of a tuple go, in order, to
    the next output of their shape. Any other value is a tuple of a single part. Open extents of
    the request may be up to `MOST_POINTS`.

    Raises:
        ValueError: if there is no output, an output has another shape or is no number, or
            iterations are negative.
    """
    counts = task.counts(inputs)
    if isinstance(returned, Mapping):
        fields = [field for field in task.outputs if returned.get(field.name) is not None]
        outputs = {field.name: checked(field, counts, returned[field.name]) for field in fields}
        summary = f"the keys {', '.join(map(str, returned))}" if returned else "an empty dict"
    else:
        parts = list(returned) if isinstance(returned, tuple) else [returned]
        outputs = {} if returned is None else _by_shape(task, counts, parts)
        summary = "; ".join(map(_describe, parts))
    if not outputs:
        names = ", ".join(f"{field.name} {_shape(field.shape)}" for field in task.outputs)
        expected = f"some of {names}" if len(task.outputs) > 1 else names
        raise ValueError(f"{task.name}: expected {expected}, got {summary}")
    for field in task.outputs:
        is_open = any(isinstance(length, str) and length not in counts for length in field.shape)
        if is_open and field.name in outputs and (size := len(outputs[field.name])) > MOST_POINTS:
            raise ValueError(f"{field.name}: expected at most {MOST_POINTS} rows, got {size}")
    if outputs.get("iterations", 0) < 0:
        raise ValueError(f"iterations: expected 0 or more, got {outputs['iterations']}")
    return outputs


def _by_shape(task: Task, counts: Mapping[str, int], parts: list[object]) -> dict[str, Any]:
    """Return each part as the next output of its shape."""
    outputs: dict[str, Any] = {}
    fields = iter(task.outputs)
    for part in parts:
        for field in fields:
            with contextlib.suppress(ValueError):
                outputs[field.name] = checked(field, counts, part)
                break
    return outputs


def checked(field: Field, counts: Mapping[str, int], value: object) -> Any:
    """Return a value as an array, number or text, null as NaN; raise ValueError of a misfit."""
    if field.kind == "text":
        if isinstance(value, str):
            return value
        raise ValueError(f"{field.name}: expected a text, got {_describe(value)}")
    array = _array(field, value)
    shape = tuple(counts.get(n, n) if isinstance(n, str) else n for n in field.shape)
    if array.size == 0 and array.ndim < len(shape):  # empty nested lists do not show their depth
        array = array.reshape(
            [0, *(length if isinstance(length, int) else 0 for length in shape[1:])]
        )
    if len(shape) != array.ndim or any(
        isinstance(n, int) and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise ValueError(f"{field.name}: expected shape {_shape(shape)}, got {_describe(array)}")
    return array if shape else array.item()


def _array(field: Field, value: object) -> Any:
    try:
        if _holds_text(value):  # NumPy would make an array as wide as the longest text
            raise ValueError
        array = np.asarray(value)
        if array.dtype == object:  # None among the numbers
            array = np.asarray(value, dtype=np.float64)
        if array.dtype.kind not in "biuf" or (field.kind != "number" and not _whole(array)):
            raise ValueError
        return np.array(array, dtype=_TYPES[field.kind])
    except (TypeError, ValueError, OverflowError, RecursionError):
        shape = f"{field.kind}s of shape {_shape(field.shape)}"
        expected = shape if field.shape else f"one {field.kind}"
        kind = f"{value.dtype} values of shape " if isinstance(value, np.ndarray) else ""
        raise ValueError(
            f"{field.name}: expected {expected}, got {kind}{_describe(value)}"
        ) from None


def _holds_text(value: object) -> bool:
    return isinstance(value, str) or (
        isinstance(value, list | tuple) and any(map(_holds_text, value))
    )


def _whole(array: Any) -> bool:
    """Return whether all numbers are integers of at most 64 bits."""
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
