"""The JSON Schema of the protocol, which `plumbob verify --schema` prints."""

import json
from collections.abc import Iterable
from typing import Any

import msgspec

from .greeting import PROTOCOL, Greeting
from .task import TASKS, Field

GREETING_REQUEST, GREETING, ERROR = "greeting_request", "greeting", "error"
_ID = {"type": "integer", "minimum": 0, "description": "an answer repeats its request's"}
_SECONDS = {"type": "number", "minimum": 0, "description": "what the solver itself took [s]"}
_TYPES: dict[str, Any] = {
    "number": {"type": ["number", "null"]},  # null is NaN
    "integer": {"type": "integer"},
    "boolean": {"type": "boolean"},
    "text": {"type": "string"},
}


def schema() -> dict[str, Any]:
    """Return the schema of any message; `$defs` has each kind of message by its name."""
    hello = {"id": {"const": 0}, "task": {"const": "greeting"}, "protocol": {"const": PROTOCOL}}
    error = {"id": _ID, "error": {"type": "string"}}
    messages = {
        GREETING_REQUEST: _message("What is asked first.", hello, list(hello)),
        **_greeting(),
        ERROR: _message("Why there is no answer.", error, list(error)),
    }
    for task in TASKS.values():
        inputs = {"id": _ID, "task": {"const": task.name}} | _fields(task.inputs)
        required = [field.name for field in task.inputs if not field.optional]
        messages[request_name(task.name)] = _message(task.about, inputs, ["id", "task", *required])
        outputs = {"id": _ID, "seconds": _SECONDS} | _fields(task.outputs)
        messages[answer_name(task.name)] = {
            **_message(f"Of {task.name}.", outputs, ["id"]),
            "anyOf": [{"required": [field.name]} for field in task.outputs],
        }
    kinds = [name for name in messages if name not in ("System", "Step", "Fixed")]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"Messages of `plumbob verify`, protocol {PROTOCOL}",
        "anyOf": [{"$ref": f"#/$defs/{name}"} for name in kinds],
        "$defs": messages,
    }


def request_name(task: str) -> str:
    """Return the key in `$defs` of a task's requests."""
    return f"{task}_request"


def answer_name(task: str) -> str:
    """Return the key in `$defs` of a task's answers."""
    return f"{task}_answer"


def _greeting() -> dict[str, Any]:
    """Return the schemas of the greeting and of its parts, as from msgspec, with an id."""
    _, parts = msgspec.json.schema_components([Greeting], ref_template="#/$defs/{name}")
    greeting = parts.pop("Greeting")
    greeting["properties"] = {"id": _ID, **greeting["properties"]}
    greeting["properties"]["protocol"] = {"const": PROTOCOL}
    greeting["properties"]["tasks"]["items"] = {"enum": list(TASKS)}
    greeting["required"] = ["id", *greeting["required"]]
    for part in (greeting, *parts.values()):
        part["description"] = "\n".join(map(str.strip, part["description"].splitlines()))
    return {GREETING: greeting, **parts}


def _message(about: str, properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    head = {"description": about, "type": "object"}
    return {**head, "properties": properties, "required": required}


def _fields(fields: Iterable[Field]) -> dict[str, Any]:
    """Return the schemas of fields: nested arrays; a word stands for any count."""
    schemas = {}
    for field in fields:
        kind = _TYPES[field.kind]
        for count in reversed(field.shape):
            kind = {"type": "array", "items": kind}
            if isinstance(count, int):
                kind |= {"minItems": count, "maxItems": count}
        shape = f" ({', '.join(map(str, field.shape))})" if field.shape else ""
        schemas[field.name] = {**kind, "description": field.about + shape}
    return schemas


def text() -> str:
    """Return the schema as JSON."""
    return json.dumps(schema(), indent=1, ensure_ascii=False)
