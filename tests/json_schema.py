"""A check of values against the part of JSON Schema that the protocol's schema uses."""

_TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "null": type(None),
    "number": (int, float),
    "integer": int,
}
_NOTES = {"$schema", "$defs", "title", "description", "default"}


def errors(value, schema, root, path="$"):
    """Return what breaks the schema, as texts that begin with the path of the value.

    Raises:
        ValueError: if the schema has a keyword that is not checked here.
    """
    found = []
    for keyword, expected in schema.items():
        if keyword in _NOTES:
            continue
        if keyword not in _RULES:
            raise ValueError(f"schema: expected a keyword that is known here, got {keyword}")
        found += _RULES[keyword](value, expected, schema, root, path)
    return found


def _is(value, kind):
    if isinstance(value, bool) and kind != "boolean":
        return False
    return isinstance(value, _TYPES[kind]) or (
        kind == "integer" and isinstance(value, float) and value % 1 == 0
    )


def _type(value, expected, schema, root, path):
    kinds = [expected] if isinstance(expected, str) else expected
    if any(_is(value, kind) for kind in kinds):
        return []
    return [f"{path}: expected {' or '.join(kinds)}"]


def _properties(value, expected, schema, root, path):
    if not isinstance(value, dict):
        return []
    present = [name for name in expected if name in value]
    return [e for n in present for e in errors(value[n], expected[n], root, f"{path}.{n}")]


def _required(value, expected, schema, root, path):
    if not isinstance(value, dict):
        return []
    return [f"{path}: expected {name}" for name in expected if name not in value]


def _additional(value, expected, schema, root, path):
    assert expected is False
    known = schema.get("properties", {})
    return [f"{path}: expected no {name}" for name in value if name not in known]


def _items(value, expected, schema, root, path):
    if not isinstance(value, list):
        return []
    return [e for i, v in enumerate(value) for e in errors(v, expected, root, f"{path}[{i}]")]


def _min_items(value, expected, schema, root, path):
    few = isinstance(value, list) and len(value) < expected
    return [f"{path}: expected {expected} items at least"] if few else []


def _max_items(value, expected, schema, root, path):
    many = isinstance(value, list) and len(value) > expected
    return [f"{path}: expected {expected} items at most"] if many else []


def _minimum(value, expected, schema, root, path):
    low = _is(value, "number") and value < expected
    return [f"{path}: expected {expected} or more"] if low else []


def _maximum(value, expected, schema, root, path):
    high = _is(value, "number") and value > expected
    return [f"{path}: expected {expected} or less"] if high else []


def _max_length(value, expected, schema, root, path):
    long = isinstance(value, str) and len(value) > expected
    return [f"{path}: expected {expected} characters at most"] if long else []


def _const(value, expected, schema, root, path):
    return [] if value == expected else [f"{path}: expected {expected}"]


def _enum(value, expected, schema, root, path):
    return [] if value in expected else [f"{path}: expected one of {expected}"]


def _any_of(value, expected, schema, root, path):
    tried = [errors(value, one, root, path) for one in expected]
    return [] if any(not found for found in tried) else [f"{path}: fits none of anyOf"]


def _ref(value, expected, schema, root, path):
    return errors(value, root["$defs"][expected.removeprefix("#/$defs/")], root, path)


_RULES = {
    "type": _type,
    "properties": _properties,
    "required": _required,
    "additionalProperties": _additional,
    "items": _items,
    "minItems": _min_items,
    "maxItems": _max_items,
    "minimum": _minimum,
    "maximum": _maximum,
    "maxLength": _max_length,
    "const": _const,
    "enum": _enum,
    "anyOf": _any_of,
    "$ref": _ref,
}
