"""Requests and answers as lines of JSON, and greetings in words that a stranger can mend.

Numbers are written with the shortest digits that give the same number back. null in an answer is
NaN. JSON has no other word for what is no number, but many writers print one: NaN, nan, -nan,
-nan(ind), Infinity, inf are understood in an answer as well, and never written in a request.

Besides the outputs of its task an answer may hold "seconds", the solver's own time; "printed", the
beginning of what it printed; "changed", the names of the inputs that it changed. One that says
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

from .case import Case
from .contestant import Answer, Failure, FailureKind
from .functions import checked, raised, understand
from .greeting import MOST_ITERATIONS, PROTOCOL, Greeting
from .sentence import Sentence, did_you_mean, sentence
from .task import TASKS, Task

GREETING = "greeting"
_OF_ANY_ANSWER = ("id", "seconds", "printed")
# No clock tells less, and no answer takes less; coarse clocks tick so seldom [s].
LEAST_SECONDS, TICK = 1e-9, 0.02
NO_SECONDS = sentence(
    "Not timed: only the round trips of requests are known, and these are mostly the time of the "
    'pipe. Send the time of your function alone as "seconds" (docs/protocol.md).'
)
_BOM = b"\xef\xbb\xbf"
# Texts, so that they are left as they are, and words for what is no number. A text without an end
# is matched as well: looking for the end of each text within it would take quadratic time.
_WORDS = re.compile(
    r'"(?:[^"\\]|\\.)*+"?|([+-]?)\b(nan(?:\(\w*\))?|inf(?:inity)?)(?!\w)',
    re.IGNORECASE | re.DOTALL,
)
_PLACE = re.compile(r" \((?:byte|char) (\d+)\)$")
_NAMES: Mapping[Any, str] = {str: "a text", int: "an integer", float: "a number", bool: "a boolean"}


class Request(NamedTuple):
    """A request as a solver reads it; the task is "greeting" in the first one."""

    id: int
    task: str
    inputs: Mapping[str, Any]


def encode_greeting(number: int = 0) -> bytes:
    """Return the line that asks a solver what it is."""
    return _line({"id": number, "task": GREETING, "protocol": PROTOCOL})


def encode_case(number: int, case: Case) -> bytes:
    """Return the line that asks a case, arrays as nested lists, NaN as null.

    Raises:
        ValueError: if a number is infinite, for which JSON has no word.
    """
    inputs = {name: plain(value) for name, value in case.inputs.items() if value is not None}
    for name, value in case.inputs.items():
        if isinstance(value, float | np.ndarray) and np.isinf(value).any():
            raise ValueError(f"{name}: expected finite numbers, got {value}")
    return _line({"id": number, "task": case.task, **inputs})


def encode_answer(number: int, **fields: Any) -> bytes:
    """Return the line that answers a request; infinite numbers are written as Infinity."""
    values = {name: plain(value) for name, value in fields.items()}
    return json.dumps({"id": number, **values}).encode() + b"\n"


def plain(value: Any) -> Any:
    """Return an array as nested lists and a NumPy number as Python's."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _line(fields: Mapping[str, Any]) -> bytes:
    return msgspec.json.encode(fields) + b"\n"


def decode_object(line: bytes) -> dict[str, Any] | None:
    """Return the JSON object of a line, or None if it is something else: a stray print.

    A print that was not ended, before the object on the same line, is left aside.

    Raises:
        ValueError: if the line begins as an object and is not one.
    """
    text = line.removeprefix(_BOM).strip()
    if not text.startswith(b"{"):
        inside = re.search(rb'\{\s*"id"', text)
        if inside is None:
            return None
        text = text[inside.start() :]
    try:
        try:
            return msgspec.json.decode(text, type=dict[str, Any])
        except (msgspec.MsgspecError, ValueError):
            return _decode_leniently(text)
    except RecursionError:
        raise ValueError("expected lists of numbers, got lists nested too deeply") from None


def _decode_leniently(text: bytes) -> dict[str, Any]:
    """Understand words for what is no number, and numbers that no double holds."""
    try:
        return json.loads(_WORDS.sub(_word, text.decode()))
    except UnicodeDecodeError as error:
        raise ValueError(f"expected UTF-8, got byte {text[error.start]:#x}") from None
    except ValueError as error:
        place = getattr(error, "pos", 0)
        around = shown(text.decode()[max(place - 30, 0) : place + 30])
        what = getattr(error, "msg", None) or str(error)
        raise ValueError(f"expected JSON, got {around!r} ({what}, character {place + 1})") from None


def _word(match: re.Match[str]) -> str:
    sign, word = match.groups()
    if word is None:
        return match[0]
    return "NaN" if word[0] in "nN" else f"{'-' if sign == '-' else ''}Infinity"


def shown(text: str | bytes, most: int = 200) -> str:
    """Return a text of a solver on one line, without control characters, shortened."""
    words = text.decode(errors="replace") if isinstance(text, bytes) else text
    clean = "".join(one if one.isprintable() else " " for one in words[: 4 * most])
    clean = " ".join(clean.split())
    return clean if len(clean) <= most else f"{clean[: most - 3]}..."


def decode_request(line: bytes) -> Request:
    """Return a request with its inputs as arrays, as a solver written in Python reads it.

    Raises:
        ValueError: if it is none.
    """
    fields = decode_object(line)
    if fields is None or not isinstance(fields.get("id"), int):
        raise ValueError(f"request: expected an object with an id, got {shown(line)}")
    if fields.get("task") == GREETING:
        return Request(fields["id"], GREETING, {})
    task = TASKS[one_of("task", fields.get("task"), TASKS)]
    known = [field for field in task.inputs if field.name in fields]
    inputs = {field.name: checked(field, {}, fields[field.name]) for field in known}
    return Request(fields["id"], task.name, inputs)


def decode_answer(
    fields: Mapping[str, Any], task: Task, inputs: Mapping[str, Any], seconds: float
) -> Answer | Failure:
    """Return what an object of JSON answers to a request.

    Args:
        fields: the object.
        task: the request's.
        inputs: the request's, for the shapes of the answer.
        seconds: from the request to the answer, taken if there is no time of the solver's own.
    """
    if fields.get("error") is not None:
        return decode_error(fields)
    try:
        values = understand(task, inputs, fields)
    except ValueError as error:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=shown(str(error), 400)))
    untimed = _why_untimed(fields.get("seconds"), seconds)
    own = seconds if untimed else min(float(fields["seconds"]), seconds)
    return Answer(values, own, _decode_remarks(fields, inputs), untimed)


def decode_error(fields: Mapping[str, Any]) -> Failure:
    """Return the failure of an answer that says why there is none."""
    why = shown(str(fields["error"]), 400)
    if fields.get("kind") == FailureKind.GARBAGE:
        return Failure(FailureKind.GARBAGE, sentence("{why}", why=why))
    if fields.get("kind") == FailureKind.RAISED:
        exception, file = (shown(str(fields.get(key, ""))) for key in ("exception", "file"))
        line = fields.get("line")
        return raised(exception, why, file, line if isinstance(line, int) else 0)
    return Failure(FailureKind.REFUSED, sentence("It says that it cannot: {why}", why=why))


def _why_untimed(own: object, seconds: float) -> Sentence | None:
    """Return why "seconds" of an answer is not the solver's own time, None if it may be."""
    if own is None:
        return NO_SECONDS
    if (
        isinstance(own, int | float)
        and not isinstance(own, bool)
        and (own == 0.0 or LEAST_SECONDS <= own < seconds + TICK)
    ):
        return None
    return sentence(
        'Not timed: expected "seconds" as 0, or a number from 1e-9 to the time that the answer '
        "took, got {own}.",
        own=shown(repr(own), 40),
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
    """Return the remark about lines on standard output that are no answers."""
    return sentence("It prints to its standard output, for example: {line}", line=shown(line, 80))


def decode_greeting(fields: Mapping[str, Any], what: str = "greeting") -> Greeting:
    """Return what a solver says of itself.

    Args:
        fields: an object of JSON.
        what: what to call it in a message.

    Raises:
        ValueError: if something in it is not understood.
    """
    given = {name: value for name, value in fields.items() if name not in _OF_ANY_ANSWER}
    if given.get("protocol") != PROTOCOL:
        raise ValueError(
            f"{what}: protocol: expected {PROTOCOL}, got {excerpt(given.get('protocol', 'none'))}"
        )
    tasks = given.get("tasks")
    if not isinstance(tasks, list | tuple) or not tasks:
        raise ValueError(
            f"{what}: tasks: expected some of {', '.join(TASKS)}, got {excerpt(tasks)}"
        )
    for task in tasks:
        one_of(f"{what}: tasks", task, TASKS)
    given["tasks"] = tuple(dict.fromkeys(tasks))
    _check_fields(given, Greeting, what)
    greeting = msgspec.convert(given, Greeting)
    total = (greeting.step.iterations or 1) * (greeting.step.substeps or 1)
    if total > MOST_ITERATIONS:
        raise ValueError(
            f"{what}: step: iterations: expected at most {MOST_ITERATIONS} in all substeps "
            f"together, got {total}"
        )
    return msgspec.structs.replace(greeting, methods=greeting.methods or ("",))


def _check_fields(given: Mapping[str, Any], kind: type[msgspec.Struct], path: str) -> None:
    known = {field.name: field.type for field in msgspec.structs.fields(kind)}
    for name, value in given.items():
        wanted = known[one_of(path, name, known)]
        if isinstance(wanted, type) and issubclass(wanted, msgspec.Struct):
            if not isinstance(value, dict):
                raise ValueError(f"{path}: {name}: expected an object, got {excerpt(value)}")
            _check_fields(value, wanted, f"{path}: {name}")
            continue
        try:
            number = msgspec.convert(value, wanted)
        except msgspec.ValidationError:
            words = f"expected {_words(wanted)}, got {excerpt(value)}"
            raise ValueError(f"{path}: {name}: {words}") from None
        if isinstance(number, float) and not math.isfinite(number):
            raise ValueError(f"{path}: {name}: expected a finite number, got {value!r}")


def excerpt(value: object) -> str:
    """Return a value as Python writes it; of a long text or list the beginning and the length."""
    text = shown(repr(value), 60)
    if not text.endswith("...") or not isinstance(value, str | list | tuple):
        return text
    return f"{len(value)} {'characters' if isinstance(value, str) else 'entries'}: {text}"


def _words(kind: Any) -> str:
    """Return what values a type has."""
    if get_origin(kind) is Annotated:
        base, limits = get_args(kind)
        return f"{_words(base)}{_limits_in_words(limits, get_origin(base) is tuple)}"
    if get_origin(kind) is Literal:
        return " or ".join(map(repr, get_args(kind)))
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(_words(one) for one in get_args(kind) if one is not NoneType)
    if get_origin(kind) is tuple:
        return f"a list of {_words(get_args(kind)[0]).replace('a text', 'texts')}"
    return _NAMES[kind]


def _limits_in_words(limits: msgspec.Meta, is_list: bool) -> str:
    if limits.max_length is not None:
        most = limits.max_length
        return f", at most {most} of them" if is_list else f" of at most {most} characters"
    return f" from {limits.ge} to {limits.le}" if limits.le else f" of {limits.ge} or more"


def one_of(name: str, value: object, known: Iterable[str]) -> str:
    """Return a value that is one of those known.

    Raises:
        ValueError: if it is none of them, with the nearest.
    """
    options = list(known)
    if isinstance(value, str) and value in options:
        return value
    raise ValueError(
        f"{name}: expected one of {', '.join(options)}, got {excerpt(value)}"
        f"{did_you_mean(value, options)}"
    )
