"""Faults of mass-spring solvers as changes of a problem or of a model; `faults.toml` lists them."""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from itertools import combinations, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..sentence import Sentence, sentence, with_code
from .model import Integrator, StepModel, SystemMatrix
from .problem import SpringProblem, frames

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
    output: bool = False  # whether it changes all forces at the end
    rare: bool = False  # whether it is not tried together with faults
    part: str = ""  # the part of a step that it changes alone: forces, matrix; "" or both


def _with_masses(p: SpringProblem, masses: FloatArray) -> dict[str, Any]:
    """Return masses that are both inert and heavy."""
    return {"masses": masses, "weighing": masses, "weights": masses[:, None] * p.gravity}


def _with_gravity(p: SpringProblem, gravity: FloatArray) -> dict[str, Any]:
    return {"gravity": gravity, "weights": p.weighing[:, None] * gravity}


def _without_spring(p: SpringProblem, index: int) -> dict[str, Any]:
    factors = np.ones(len(p.springs))
    factors[index] = 0.0
    return {"stiffnesses": factors * p.stiffnesses, "dampings": factors * p.dampings}


def _first_for_all(p: SpringProblem, name: str) -> dict[str, Any]:
    return {name: np.resize(getattr(p, name)[:1], len(p.springs))}


def _lengths(p: SpringProblem) -> FloatArray:
    return np.maximum(frames(p, p.positions)[0], 1e-150)


def _as_if_long(p: SpringProblem, length: float) -> dict[str, Any]:
    """Return the numbers with which springs pull as if all were that long."""
    share, stretch = _lengths(p) / length, _lengths(p) - p.rest_lengths
    stretch = np.where(stretch != 0.0, stretch, 1e-12)
    return {
        "stiffnesses": p.stiffnesses * share * (length - p.rest_lengths) / stretch,
        "dampings": p.dampings * share**2,
    }


# What an entry of faults.toml may hold.
FIELDS = {
    *("code", "program", "lines", "example", "key", "sentence", "tasks", "parts", "rare", "each"),
    *("scale", "set", "model", "integrator", "matrix", "value", "part", "energy", "output"),
}
# Faults that are no fixed factors or fields.
CHANGES: Mapping[str, Callable[..., Mapping[str, Any]]] = {
    "mass inverse missing": lambda p: {"masses": np.ones(p.count)},
    "mass inverse squared": lambda p: {"masses": p.masses**2},
    "mass multiplied": lambda p: {"masses": 1.0 / p.masses},
    "h in place of h²": lambda p: {"stiffnesses": p.stiffnesses / p.h},
    "h² missing": lambda p: {"stiffnesses": p.stiffnesses / p.h**2},
    "mass 1 for all": lambda p: _with_masses(p, np.ones(p.count)),
    "first mass for all": lambda p: _with_masses(p, np.full(p.count, p.masses[0])),
    "gravity g/m": lambda p: {"weights": np.tile(p.gravity, (p.count, 1))},
    "gravity of its own {gravity:g}": lambda p, gravity: _with_gravity(
        p, np.array([0.0, -gravity, 0.0])
    ),
    "gravity m² g": lambda p: {"weights": p.weighing[:, None] * p.weights},
    "rest length 1 for all": lambda p: {"rest_lengths": np.ones(len(p.springs))},
    "stiffness 1 for all": lambda p: {"stiffnesses": np.ones(len(p.springs))},
    "springs with h": lambda p: {"stiffnesses": p.stiffnesses / p.h},
    "springs without h²": lambda p: {"stiffnesses": p.stiffnesses / p.h**2},
    "gravity with h³": lambda p: {"weights": p.weights * p.h},
    "gravity along z": lambda p: _with_gravity(p, np.array([0.0, 0.0, -np.linalg.norm(p.gravity)])),
    "gravity without h²": lambda p: {"weights": p.weights / p.h**2},
    "gravity with h": lambda p: {"weights": p.weights / p.h},
    "external forces as accelerations": lambda p: {"external": p.weighing[:, None] * p.external},
    "rest length from the state": lambda p: {"rest_lengths": frames(p, p.positions)[0]},
    "stiffness over rest length": lambda p: {
        "stiffnesses": p.stiffnesses / np.where(p.rest_lengths > 0.0, p.rest_lengths, 1.0)
    },
    "last spring left out": lambda p: _without_spring(p, -1),
    "first spring left out": lambda p: _without_spring(p, 0),
    "first stiffness for all": lambda p: _first_for_all(p, "stiffnesses"),
    "first rest length for all": lambda p: _first_for_all(p, "rest_lengths"),
    "first damping for all": lambda p: _first_for_all(p, "dampings"),
    "damping times stiffness": lambda p: {"dampings": p.dampings * p.stiffnesses},
    "damping with h": lambda p: {"dampings": p.h * p.dampings},
    "damping without h": lambda p: {"dampings": p.dampings / p.h},
    "stiffness and rest length swapped": lambda p: {
        "stiffnesses": p.rest_lengths,
        "rest_lengths": p.stiffnesses,
    },
    "stiffness and damping swapped": lambda p: {
        "stiffnesses": p.dampings,
        "dampings": p.stiffnesses,
    },
    "mass and h swapped": lambda p: (
        _with_masses(p, np.full(p.count, p.h)) | {"h": float(p.masses[0])}
    ),
    "pins as a mask": lambda p: {"pinned": np.flatnonzero(p.pinned[: p.count])},
    "kinetic without mass": lambda p: {"masses": np.ones(p.count)},
    "mean rest length for all": lambda p: {
        "rest_lengths": np.full(len(p.springs), p.rest_lengths.mean())
    },
    "mean stiffness for all": lambda p: {
        "stiffnesses": np.full(len(p.springs), p.stiffnesses.mean())
    },
    "rest length of the next spring": lambda p: {"rest_lengths": np.roll(p.rest_lengths, -1)},
    "stretch without sign": lambda p: {
        "stiffnesses": p.stiffnesses * np.sign(_lengths(p) - p.rest_lengths)
    },
    "stretch squared": lambda p: {
        "stiffnesses": p.stiffnesses * np.abs(_lengths(p) - p.rest_lengths)
    },
    "length with {length:g} added": lambda p, length: {
        "stiffnesses": p.stiffnesses * _lengths(p) / (_lengths(p) + length),
        "dampings": p.dampings * (_lengths(p) / (_lengths(p) + length)) ** 2,
    },
    "length of all springs together": lambda p: _as_if_long(p, float(np.linalg.norm(_lengths(p)))),
    "damping over length": lambda p: {"dampings": p.dampings / _lengths(p)},
    "damping times length": lambda p: {"dampings": p.dampings * _lengths(p)},
    "damping times length squared": lambda p: {"dampings": p.dampings * _lengths(p) ** 2},
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
        option = Option(key, aspect, message, change, fields, parts, energy, output, rare, part)
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
    function = CHANGES.get(entry.get("key", ""))
    return partial(function, **values) if function else None


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
    usual = [option for option in options if not option.rare]
    for count in range(1, MAX_FAULTS + 1):
        for faults in combinations(options if count < MAX_FAULTS else usual, count):
            if len({fault.aspect for fault in faults}) == count:
                yield faults
