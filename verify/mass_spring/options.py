"""Choices of a solver, right or wrong, as changes of a problem or of a model."""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from plumbob.text.sentence import Sentence, with_code

from .formulas import evaluate
from .model import RIGHT_MATRIX, Integrator, StepModel, SystemMatrix
from .problem import SpringProblem

# Aspects of a step in the order of the computation.
ASPECTS = (
    "time", "reading", "inertia", "masses", "gravity", "springs", "damping", "damper", "integrator",
    "matrix", "substeps", "pins", "velocity", "update", "scaling", "frames", "answers",
    "factorisation",
)  # fmt: skip


Change = Callable[[SpringProblem], Mapping[str, Any]]


class Option(NamedTuple):
    """A choice of a solver in an aspect of a step, right or wrong."""

    key: str  # its name in reports
    aspect: str  # what it is a choice of; a solver makes one choice for each aspect
    sentence: Sentence  # what it does, and for a fault its code and what to do instead
    change: Change | None = None  # returns the fields that it replaces in a problem
    fields: Mapping[str, Any] = {}  # the fields that it replaces in a model
    parts: tuple[float, ...] = ()  # factors of the kinetic, elastic and gravitational energy
    # which energy has another formula, or a sum, one of its parts, and the factor of that
    energy: tuple[Any, ...] = ()
    output: str = ""  # a formula of what all forces become at the end
    formula: str = ""  # of the energy that `energy` names
    # whether it is not tried together with faults of a step, nor with two of forces, or "alone"
    rare: bool | str = False
    part: str = ""  # the part of a step that it changes alone: forces, matrix; "" or both
    # of a fault with a number that answers tell: least and greatest, and the fault with a number
    range: tuple[float, float] | None = None
    at: "Callable[[float], Option] | None" = None


# No solver is searched for more faults at once.
MAX_FAULTS = 3
# Parts of a step that a choice may change alone.
PARTS = ("forces", "matrix", "energy")
# What an entry of faults.toml may hold.
FIELDS = {
    *("code", "program", "lines", "example", "key", "sentence", "tasks", "parts", "rare", "each"),
    *("scale", "set", "change", "formula", "model", "integrator", "matrix", "value"),
    *("part", "energy", "output", "whole", "fit", "length", "pull", "damper_pull", "damper_rest"),
}


# Fields of a problem that are formulas, computed wherever a step needs them.
RULES = ("length", "pull", "damper_pull", "damper_rest")


def read_table(name: str) -> dict[str, Any]:
    """Return the content of a TOML file of this folder."""
    return tomllib.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))


def options_of(aspect: str, entry: Mapping[str, Any]) -> Iterator[Option]:
    """Yield an option for each combination of the numbers in an entry's `each`."""
    ranges = entry.get("each", {})
    for numbers in product(*ranges.values()):
        values = dict(zip(ranges, numbers, strict=True))
        if "fit" in entry:
            yield _fitted(aspect, entry, values)
            continue
        option = option_of(aspect, entry, values)
        yield option
        if aspect == "inertia" and option.fields:
            yield option._replace(fields={**option.fields, "right_start": True})
        matrix = option.fields.get("matrix")
        if matrix is not None and "dv" not in option.fields and matrix.masses == 1.0:
            yield option._replace(fields={**option.fields, "dv": True})
            if matrix.element != RIGHT_MATRIX.element:
                apart = matrix._replace(is_drag_right=True)
                yield option._replace(fields={**option.fields, "dv": True, "matrix": apart})
        if matrix is not None and matrix.pins_element is None:
            right = matrix._replace(pins_element=RIGHT_MATRIX.element)
            yield option._replace(fields={**option.fields, "matrix": right})


def _fitted(aspect: str, entry: Mapping[str, Any], values: Mapping[str, Any]) -> Option:
    """Return a fault with a number that answers tell, until then that of its example or the least.

    Its fields, its key and its sentence depend on the number.
    """
    ((name, (low, high)),) = entry["fit"].items()

    def at(number: float) -> Option:
        return option_of(aspect, entry, {**values, name: number})

    example = entry.get("example", {}).get(name, low)
    return at(example)._replace(range=(low, high), at=at)


def option_of(aspect: str, entry: Mapping[str, Any], values: Mapping[str, Any]) -> Option:
    """Return the option of an entry with numbers by their names."""
    fields = _filled(dict(entry.get("model", {})), values)
    if "value" in entry:
        fields[aspect] = entry["value"].format(**values)
    elif "matrix" in entry:
        fields["matrix"] = _matrix(entry["matrix"] | values)
    elif "integrator" in entry:
        fields["integrator"] = Integrator(**entry["integrator"], **values)
    elif aspect in values and aspect in StepModel._fields and not fields:
        fields[aspect] = values[aspect]
    name = " ".join(map(str, fields.get("integrator", ()))) or f"{aspect} {entry.get('value')}"
    message = Sentence(entry["sentence"], values)
    rare = entry.get("rare", False)
    return Option(
        key=entry.get("key", name).format(**values).replace(" + ", "+"),  # which joins keys
        aspect=aspect,
        sentence=with_code(entry["code"], message) if "code" in entry else message,
        change=_change(entry, values),
        fields=fields,
        parts=tuple(entry.get("parts", ())),
        energy=tuple(values.get(name, name) for name in entry.get("energy", ())),
        output=entry.get("output", "").format(**values),
        formula=entry.get("formula", "").format(**values),
        rare=any(x in rare for x in values.values()) if isinstance(rare, list) else rare,
        part=entry.get("part", ""),
    )


def _filled(content: Any, values: Mapping[str, Any]) -> Any:
    """Return the content of a table with numbers in place of their names in its texts."""
    if isinstance(content, dict):
        return {name.format(**values): _filled(inner, values) for name, inner in content.items()}
    return content.format(**values) if isinstance(content, str) else content


def _matrix(fields: Mapping[str, Any]) -> SystemMatrix:
    """Return a matrix whose lists are tuples."""
    tuples: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
    return SystemMatrix(**tuples)


def _change(entry: Mapping[str, Any], values: Mapping[str, Any]) -> Change | None:
    if unknown := entry.keys() - FIELDS:
        raise ValueError(f"faults.toml: expected {sorted(FIELDS)}, got {sorted(unknown)}")
    if "scale" in entry:
        return lambda p: {name: f * getattr(p, name) for name, f in entry["scale"].items()}
    if "set" in entry:
        return lambda p: entry["set"]
    if not entry.keys() & {"change", *RULES}:
        return None
    filled = _filled({name: entry[name] for name in entry.keys() & {"change", *RULES}}, values)
    changes = filled.pop("change", {})
    rules = {name: partial(_value, formula, values) for name, formula in filled.items()}
    return lambda p: rules | {field: evaluate(f, p, values) for field, f in changes.items()}


def _value(formula: str, numbers: Mapping[str, Any], p: SpringProblem, **values: Any) -> Any:
    return evaluate(formula, p, {**numbers, **values})


def apply(
    options: Sequence[Option], p: SpringProblem, model: StepModel
) -> tuple[SpringProblem, StepModel]:
    """Return the problem and the model as a solver with these options has them."""
    linear = p
    for option in options:
        if option.change is not None and option.part != "matrix":
            p = p.changed(**option.change(p))
        if option.change is not None and option.part != "forces":
            linear = linear.changed(**option.change(linear))
        if option.fields:
            model = model._replace(**option.fields)
    is_apart = any(option.part in PARTS for option in options)
    return p.changed(linear=linear) if is_apart else p, model
