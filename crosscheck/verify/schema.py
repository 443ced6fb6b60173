"""The JSON Schema of the protocol's messages, made from the tasks and the greeting.

`python -m plumbob.crosscheck.verify.schema` writes it beside this file.
"""

import json
from pathlib import Path
from typing import Any

import msgspec

from .greeting import PROTOCOL, Greeting
from .task import TASKS, Field, Task

FILE = Path(__file__).with_name("protocol.schema.json")
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
    messages = {GREETING_REQUEST: _greeting_request(), **_greeting(), ERROR: _error()}
    for task in TASKS.values():
        messages[request_name(task.name)] = _request(task)
        messages[answer_name(task.name)] = _answer(task)
    kinds = [name for name in messages if name not in ("System", "Step")]
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


def _greeting_request() -> dict[str, Any]:
    properties = {
        "id": {"const": 0},
        "task": {"const": "greeting"},
        "protocol": {"const": PROTOCOL},
    }
    return _object("What is asked first.", properties, list(properties))


def _greeting() -> dict[str, Any]:
    """Return the schemas of the greeting and of its parts, as msgspec makes them, with an id."""
    _, parts = msgspec.json.schema_components([Greeting], ref_template="#/$defs/{name}")
    greeting = parts.pop("Greeting")
    greeting["properties"] = {"id": _ID, **greeting["properties"]}
    greeting["properties"]["protocol"] = {"const": PROTOCOL}
    greeting["properties"]["tasks"]["items"] = {"enum": list(TASKS)}
    greeting["required"] = ["id", *greeting["required"]]
    for part in (greeting, *parts.values()):
        part["description"] = "\n".join(map(str.strip, part["description"].splitlines()))
    return {GREETING: greeting, **parts}


def _error() -> dict[str, Any]:
    properties = {"id": _ID, "error": {"type": "string"}}
    return _object("Why there is no answer.", properties, ["id", "error"])


def _request(task: Task) -> dict[str, Any]:
    properties = {
        "id": _ID,
        "task": {"const": task.name},
        **{field.name: _field(field) for field in task.inputs},
    }
    required = [field.name for field in task.inputs if not field.optional]
    return _object(task.about, properties, ["id", "task", *required])


def _answer(task: Task) -> dict[str, Any]:
    properties = {
        "id": _ID,
        "seconds": _SECONDS,
        **{field.name: _field(field) for field in task.outputs},
    }
    some = [{"required": [field.name]} for field in task.outputs]
    return {**_object(f"Of {task.name}.", properties, ["id"]), "anyOf": some}


def _object(about: str, properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    return {
        "description": about,
        "type": "object",
        "properties": properties,
        "required": required,
    }


def _field(field: Field) -> dict[str, Any]:
    """Return nested arrays; a count that is a word may be any."""
    found = _TYPES[field.kind]
    for count in reversed(field.shape):
        found = {"type": "array", "items": found}
        if isinstance(count, int):
            found |= {"minItems": count, "maxItems": count}
    shape = f" ({', '.join(map(str, field.shape))})" if field.shape else ""
    return {**found, "description": field.about + shape}


def text() -> str:
    """Return the schema as it stands in its file."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
