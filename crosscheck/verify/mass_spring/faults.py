"""Faults of mass-spring solvers as changes of a problem or of a model; `faults.toml` lists them."""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from itertools import combinations, product
from pathlib import Path
from typing import Any, NamedTuple

from ..sentence import Sentence, sentence, with_code
from .formulas import evaluate
from .model import Integrator, StepModel, SystemMatrix
from .problem import SpringProblem

# Aspects of a step in the order of the computation.
ASPECTS = (
    "time", "inertia", "masses", "gravity", "springs", "damping", "damper", "integrator",
    "matrix", "substeps", "pins", "velocity", "update", "scaling", "frames", "factorisation",
)  # fmt: skip
# Aspects of which the forces and the matrix of an implicit step may have different versions.
IN_PARTS = ("masses", "springs", "damping")
# No solver is searched for more faults at once.
MAX_FAULTS = 3

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
    # what it makes of all forces at the end: a formula, or true for a key of OUTPUTS in forces.py
    output: str | bool = False
    formula: str = ""  # of the energy that `energy` names
    # whether it is not tried together with faults of a step, nor with two of forces, or "alone"
    rare: bool | str = False
    part: str = ""  # the part of a step that it changes alone: forces, matrix; "" or both


# What an entry of faults.toml may hold.
FIELDS = {
    *("code", "program", "lines", "example", "key", "sentence", "tasks", "parts", "rare", "each"),
    *("scale", "set", "change", "length", "formula", "model", "integrator", "matrix", "value"),
    *("part", "energy", "output"),
}
# The numbers with which springs pull as if they were of another length L.
OF_OTHER_LENGTH = {
    "rest_lengths": "0.0 * r",
    "stiffnesses": "k * (({L}) - r) / ({L})",
    "dampings": "c * (l / ({L})) ** 2",
}


def read_table(name: str) -> dict[str, Any]:
    """Return the content of a TOML file of this folder."""
    return tomllib.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))


def options_of(aspect: str, entry: Mapping[str, Any]) -> Iterator[Option]:
    """Yield an option for each combination of the numbers in an entry's `each`."""
    ranges = entry.get("each", {})
    for numbers in product(*ranges.values()):
        values = dict(zip(ranges, numbers, strict=True))
        fields = dict(entry.get("model", {}))
        if "value" in entry:
            fields[aspect] = entry["value"].format(**values)
        elif "matrix" in entry:
            fields["matrix"] = _matrix(entry["matrix"] | values)
        elif "integrator" in entry:
            fields["integrator"] = Integrator(**entry["integrator"], **values)
        elif aspect == "time" and values:
            fields["time"] = float(Fraction(values["time"]))
        elif aspect in values and aspect in StepModel._fields:
            fields[aspect] = values[aspect]
        name = " ".join(map(str, fields.get("integrator", ()))) or f"{aspect} {entry.get('value')}"
        key = entry.get("key", name).format(**values)
        message, parts = Sentence(entry["sentence"], values), tuple(entry.get("parts", ()))
        message = with_code(entry["code"], message) if "code" in entry else message
        rare = entry.get("rare", False)
        rare = any(x in rare for x in values.values()) if isinstance(rare, list) else rare
        change, part = _change(entry, values), entry.get("part", "")
        energy = tuple(values.get(name, name) for name in entry.get("energy", ()))
        output = entry.get("output", False)
        formula = entry.get("formula", "").format(**values)
        output = output.format(**values) if isinstance(output, str) else output
        option = Option(
            key, aspect, message, change, fields, parts, energy, output, formula, rare, part
        )
        yield option
        if aspect == "inertia":
            yield option._replace(fields={**fields, "right_start": True})
        if "matrix" in entry and "dv" not in fields and entry["matrix"].get("masses", 1.0) == 1.0:
            yield option._replace(fields={**fields, "dv": True})


def _matrix(fields: Mapping[str, Any]) -> SystemMatrix:
    """Return a matrix whose lists are tuples."""
    tuples: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}
    return SystemMatrix(**tuples)


def _in_parts(option: Option, entry: Mapping[str, Any]) -> Iterator[Option]:
    """Yield a fault of a step, then the same fault of the forces and of the matrix alone."""
    yield option
    if option.part or option.aspect not in IN_PARTS:
        return
    for part, words in _FAULTS["part"].items():
        where = with_code(words["code"], Sentence(words["sentence"], {}))
        message = sentence("{fault} {where}", fault=option.sentence, where=where)
        alone = option._replace(key=f"{option.key}, {part} only", sentence=message, part=part)
        has_dampers = option.aspect == "damping" or "set" in entry
        if option.aspect != "damping" or part == "matrix":
            yield alone
        if has_dampers and part == "forces":  # those of dampers stand in the equation for dv only
            yield alone._replace(fields={"dv": True})


def _change(entry: Mapping[str, Any], values: Mapping[str, Any]) -> Change | None:
    if unknown := entry.keys() - FIELDS:
        raise ValueError(f"faults.toml: expected {sorted(FIELDS)}, got {sorted(unknown)}")
    if "scale" in entry:
        return lambda p: {name: f * getattr(p, name) for name, f in entry["scale"].items()}
    if "set" in entry:
        return lambda p: entry["set"]
    formulas = entry.get("change", {})
    if "length" in entry:
        formulas = {name: f.format(L=entry["length"]) for name, f in OF_OTHER_LENGTH.items()}
    return partial(_evaluated, formulas, values) if formulas else None


def _evaluated(
    formulas: Mapping[str, str], values: Mapping[str, Any], p: SpringProblem
) -> Mapping[str, Any]:
    return {name: evaluate(formula, p, values) for name, formula in formulas.items()}


_FAULTS = read_table("faults.toml")


def faults_of(task: str, aspects: Sequence[str]) -> tuple[Option, ...]:
    """Return the faults of these aspects that show in a task: step, forces or energy."""
    options = tuple(
        option
        for aspect in aspects
        for entry in _FAULTS.get(aspect, ())
        if task in entry.get("tasks", (task,))
        for basis in options_of(aspect, entry)
        for option in (_in_parts(basis, entry) if task == "step" else [basis])
    )
    if idle := [
        option.key
        for option in options
        if not any((option.change, option.fields, option.parts, option.energy, option.output))
    ]:
        raise ValueError(f"faults.toml: expected a change of each fault, got none of {idle}")
    return options


FORCE_FAULTS = faults_of("forces", ("gravity", "springs", "damping", "forces"))
ENERGY_FAULTS = faults_of("energy", ("kinetic", "elastic", "springs", "gravitational", "sum"))
STEP_FAULTS = faults_of("step", ASPECTS)


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
    is_apart = any(option.part in _FAULTS["part"] for option in options)
    return p.changed(linear=linear) if is_apart else p, model


def combined(options: Sequence[Option]) -> Iterator[tuple[Option, ...]]:
    """Yield each option, then each pair and each triple without rare ones, of other aspects."""
    paired = [option for option in options if option.rare != "alone"]
    usual = [option for option in options if not option.rare]
    for count, choices in enumerate((options, paired, usual), start=1):
        for faults in combinations(choices, count):
            if len({fault.aspect for fault in faults}) == count:
                yield faults
