"""Requests and answers as lines of JSON, and greetings whose errors name their correction.

Numbers are written with the shortest digits for the same double. null in an answer is NaN. Many
writers print numbers beyond JSON. NaN, nan, -nan, -nan(ind), Infinity and inf are read in an
answer and never written in a request.

Besides outputs an answer may hold "seconds", the solver's own time, and "printed", the beginning of
its prints. Its field "changed" has the names of changed inputs. An answer with an
"error" may hold "kind": "raised" with the "exception", its "file" and its "line".
"""

import json
import math
import re
from collections.abc import Iterable, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import msgspec
import numpy as np

from plumbob.text.printable import one_line
from plumbob.text.sentence import Sentence, did_you_mean, sentence

from .case import Case
from .exchange import Answer, Failure, FailureKind
from .functions import checked, raised, understand
from .greeting import MOST_ITERATIONS, PROTOCOL, Greeting
from .task import TASKS, Task

GREETING = "greeting"
_OF_ANY_ANSWER = ("id", "seconds", "printed")
# The resolution of the finest clock, and the tick of a coarse clock [s].
MIN_SECONDS, TICK = 1e-9, 0.02
NO_SECONDS = sentence(
    "Not timed: only the round trips of requests are known, and these are mostly the time of the "
    'pipe. Send the time of your function alone as "seconds" (docs/protocol.md).'
)
_BOM = b"\xef\xbb\xbf"
# Texts, which stay, and words like NaN. A text without an end matches as well: looking for the end
# of each inner text would take quadratic time.
_WORDS = re.compile(
    r'"(?:[^"\\]|\\.)*+"?|([+-]?)\b(nan(?:\(\w*\))?|inf(?:inity)?)(?!\w)', re.IGNORECASE | re.DOTALL
)
_TYPE_NAMES = {str: "a text", int: "an integer", float: "a number", bool: "a boolean"}


class Request(NamedTuple):
    """A request as a solver reads the line; the first task is "greeting"."""

    id: int
    task: str
    inputs: Mapping[str, Any]


def encode_greeting() -> bytes:
    """Return the request for a greeting as a line."""
    return _line({"id": 0, "task": GREETING, "protocol": PROTOCOL})


def encode_case(number: int, case: Case) -> bytes:
    """Return the request of a case as a line, NaN as null; raise ValueError of infinite numbers."""
    inputs = {name: plain(value) for name, value in case.inputs.items() if value is not None}
    for name, value in case.inputs.items():
        if isinstance(value, float | np.ndarray) and np.isinf(value).any():
            raise ValueError(f"{name}: expected finite numbers, got {value}")
    return _line({"id": number, "task": case.task, **inputs})


def encode_answer(number: int, **fields: Any) -> bytes:
    """Return an answer as a line; infinite numbers are written as Infinity."""
    outputs = {name: plain(value) for name, value in fields.items()}
    return json.dumps({"id": number, **outputs}).encode() + b"\n"


def plain(value: Any) -> Any:
    """Return an array as nested lists and a NumPy number as Python's."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _line(fields: Mapping[str, Any]) -> bytes:
    return msgspec.json.encode(fields) + b"\n"


def decode_object(line: bytes) -> dict[str, Any] | None:
    """Return the JSON object of a line, after any print; None of a print, ValueError if invalid."""
    text = line.removeprefix(_BOM).strip()
    if not text.startswith(b"{"):
        match = re.search(rb'\{\s*"id"', text)
        if match is None:
            return None
        text = text[match.start() :]
    try:
        try:
            return msgspec.json.decode(text, type=dict[str, Any])
        except (msgspec.MsgspecError, ValueError):
            return _decode_leniently(text)
    except RecursionError:
        raise ValueError("expected lists of numbers, got lists nested too deeply") from None


def _decode_leniently(text: bytes) -> dict[str, Any]:
    """Decode JSON with words like NaN, and numbers beyond doubles."""
    try:
        return json.loads(_WORDS.sub(_json_word, text.decode()))
    except UnicodeDecodeError as error:
        raise ValueError(f"expected UTF-8, got byte {text[error.start]:#x}") from None
    except ValueError as error:
        place = getattr(error, "pos", 0)
        context = one_line(text.decode()[max(place - 30, 0) : place + 30])
        reason = getattr(error, "msg", None) or str(error)
        raise ValueError(
            f"expected JSON, got {context!r} ({reason}, character {place + 1})"
        ) from None


def _json_word(match: re.Match[str]) -> str:
    """Return JavaScript's word for NaN or infinity, as `json` reads."""
    sign, word = match.groups()
    if word is None:
        return match[0]
    return "NaN" if word[0] in "nN" else f"{'-' if sign == '-' else ''}Infinity"


def decode_request(line: bytes) -> Request:
    """Return a request with its inputs as arrays; raise ValueError if the line is no request."""
    fields = decode_object(line)
    if fields is None or not isinstance(fields.get("id"), int):
        raise ValueError(f"request: expected an object with an id, got {one_line(line)}")
    if fields.get("task") == GREETING:
        return Request(fields["id"], GREETING, {})
    task = TASKS[one_of("task", fields.get("task"), TASKS)]
    inputs = {
        field.name: checked(field, {}, fields[field.name])
        for field in task.inputs
        if field.name in fields
    }
    return Request(fields["id"], task.name, inputs)


def decode_answer(
    fields: Mapping[str, Any], task: Task, inputs: Mapping[str, Any], seconds: float
) -> Answer | Failure:
    """Return the answer in a JSON object; `seconds` is the time of the round trip."""
    if fields.get("error") is not None:
        return decode_error(fields)
    try:
        outputs = understand(task, inputs, fields)
    except ValueError as error:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=one_line(str(error), 400)))
    untimed = _why_untimed(fields.get("seconds"), seconds)
    own = seconds if untimed else min(float(fields["seconds"]), seconds)
    return Answer(outputs, own, _decode_remarks(fields, inputs), untimed)


def decode_error(fields: Mapping[str, Any]) -> Failure:
    """Return the failure of an answer with an "error"."""
    reason = one_line(str(fields["error"]), 400)
    if fields.get("kind") == FailureKind.GARBAGE:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=reason))
    if fields.get("kind") == FailureKind.RAISED:
        exception, file = (one_line(str(fields.get(key, ""))) for key in ("exception", "file"))
        line = fields.get("line")
        return raised(exception, reason, file, line if isinstance(line, int) else 0)
    return Failure(FailureKind.REFUSED, sentence("The solver reports an error: {why}", why=reason))


def _why_untimed(own: object, seconds: float) -> Sentence | None:
    """Return why "seconds" of an answer cannot be the solver's own time, or None."""
    if own is None:
        return NO_SECONDS
    if (
        isinstance(own, int | float)
        and not isinstance(own, bool)
        and (own == 0.0 or MIN_SECONDS <= own < seconds + TICK)
    ):
        return None
    return sentence(
        'Not timed: expected "seconds" as 0, or a number from 1e-9 to the time that the answer '
        "took, got {own}.",
        own=one_line(repr(own), 40),
    )


def _decode_remarks(fields: Mapping[str, Any], inputs: Mapping[str, Any]) -> tuple[Sentence, ...]:
    changed = fields.get("changed")
    names = changed if isinstance(changed, list) else []
    remarks = [
        sentence("It changed its argument {name}.", name=name) for name in inputs if name in names
    ]
    if isinstance(fields.get("printed"), str):
        remarks.append(prints(fields["printed"]))
    return tuple(remarks)


def prints(line: str | bytes) -> Sentence:
    """Return the remark about prints on standard output."""
    return sentence(
        "It prints to its standard output, for example: {line}", line=one_line(line, 80)
    )


def decode_greeting(fields: Mapping[str, Any], source: str = "greeting") -> Greeting:
    """Return the greeting in a JSON object; errors (ValueError) begin with `source`."""
    fields = {name: value for name, value in fields.items() if name not in _OF_ANY_ANSWER}
    if fields.get("protocol") != PROTOCOL:
        raise ValueError(
            f"{source}: protocol: expected {PROTOCOL}, got "
            f"{excerpt(fields.get('protocol', 'none'))}"
        )
    tasks = fields.get("tasks")
    if not isinstance(tasks, list | tuple) or not tasks:
        raise ValueError(
            f"{source}: tasks: expected some of {', '.join(TASKS)}, got {excerpt(tasks)}"
        )
    for task in tasks:
        one_of(f"{source}: tasks", task, TASKS)
    fields["tasks"] = tuple(dict.fromkeys(tasks))
    _check_fields(fields, Greeting, source)
    greeting = msgspec.convert(fields, Greeting)
    total = (greeting.step.iterations or 1) * (greeting.step.substeps or 1)
    if total > MOST_ITERATIONS:
        raise ValueError(
            f"{source}: step: iterations: expected at most {MOST_ITERATIONS} in all substeps "
            f"together, got {total}"
        )
    return msgspec.structs.replace(greeting, methods=greeting.methods or ("",))


def _check_fields(fields: Mapping[str, Any], kind: type[msgspec.Struct], path: str) -> None:
    types = {field.name: field.type for field in msgspec.structs.fields(kind)}
    for name, value in fields.items():
        expected = types[one_of(path, name, types)]
        if isinstance(expected, type) and issubclass(expected, msgspec.Struct):
            if not isinstance(value, dict):
                raise ValueError(f"{path}: {name}: expected an object, got {excerpt(value)}")
            _check_fields(value, expected, f"{path}: {name}")
            continue
        try:
            number = msgspec.convert(value, expected)
        except msgspec.ValidationError:
            message = f"expected {_type_name(expected)}, got {excerpt(value)}"
            raise ValueError(f"{path}: {name}: {message}") from None
        if isinstance(number, float) and not math.isfinite(number):
            raise ValueError(f"{path}: {name}: expected a finite number, got {value!r}")


def excerpt(value: object) -> str:
    """Return a value in Python's form; of a long text or list the beginning and the length."""
    text = one_line(repr(value), 60)
    if not text.endswith("...") or not isinstance(value, str | list | tuple):
        return text
    return f"{len(value)} {'characters' if isinstance(value, str) else 'entries'}: {text}"


def _type_name(kind: Any) -> str:
    """Return a type in words, with its limits."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        limits, name = parts[1], _type_name(parts[0])
        if limits.max_length is None:
            end = f" from {limits.ge} to {limits.le}" if limits.le else f" of {limits.ge} or more"
        elif get_origin(parts[0]) is tuple:
            end = f", at most {limits.max_length} of them"
        else:
            end = f" of at most {limits.max_length} characters"
        return name + end
    if origin is Literal:
        return " or ".join(map(repr, parts))
    if origin in (Union, UnionType):
        return " or ".join(_type_name(part) for part in parts if part is not NoneType)
    if origin is tuple:
        return f"a list of {_type_name(parts[0]).replace('a text', 'texts')}"
    return _TYPE_NAMES[kind]


def one_of(name: str, value: object, options: Iterable[str]) -> str:
    """Return an option as given; raise ValueError of other values, with the nearest option."""
    options = list(options)
    if isinstance(value, str) and value in options:
        return value
    raise ValueError(
        f"{name}: expected one of {', '.join(options)}, got {excerpt(value)}"
        f"{did_you_mean(value, options)}"
    )
