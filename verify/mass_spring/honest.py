"""The choices that an honest solver may make, and which of them a greeting leaves open."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from plumbob.text.sentence import Sentence

from ..greeting import Step
from .model import EXPLICIT, Integrator, StepModel

# Aspects of a step in the order of the computation.
ASPECTS = ("damper", "integrator", "substeps", "pins", "velocity", "scaling")
# Symplectic Euler by the order of its updates.
SYMPLECTIC = {"symplectic": "velocities_first", "positions_first": "positions_first"}
# Methods with a number of iterations.
ITERATIVE = ("newton", "local_global")
# Dampers that explicit methods can have, and of these the ones that only symplectic Euler has.
EXPLICIT_DAMPERS = ("none", "explicit", "diagonal", "blocks", "matrix")
SYMPLECTIC_DAMPERS = ("diagonal", "blocks", "matrix")
IMPLICIT_DAMPERS = ("length_rate", "end_velocity", "explicit", "none")
_TABLE = tomllib.loads(Path(__file__).with_name("honest.toml").read_text(encoding="utf-8"))


class Option(NamedTuple):
    """A choice of a solver in an aspect of a step."""

    aspect: str  # what it is a choice of; a solver makes one choice for each aspect
    sentence: Sentence  # what it does
    fields: Mapping[str, Any]  # the fields that it replaces in a model


def model_of(options: Sequence[Option]) -> StepModel:
    """Return the model of a solver with these options, without dampers unless one has them."""
    fields = {name: value for option in options for name, value in option.fields.items()}
    return StepModel(damper="none")._replace(**fields)


def _options_of(aspect: str, entry: Mapping[str, Any]) -> Iterator[Option]:
    """Yield an option for each combination of the numbers in an entry's `each`."""
    ranges = entry.get("each", {})
    for numbers in product(*ranges.values()):
        values = dict(zip(ranges, numbers, strict=True))
        if "integrator" in entry:
            choice: Any = Integrator(**entry["integrator"], **values)
        elif isinstance(entry.get("value"), str):
            choice = entry["value"].format(**values)
        else:
            choice = values.get(aspect, entry.get("value"))
        yield Option(aspect, Sentence(entry["sentence"], values), {aspect: choice})


@cache
def honest(step: Step) -> dict[str, tuple[Option, ...]]:
    """Return, for each aspect, the honest choices, the usual choice first."""
    numbers = {
        "iterations": step.iterations, "substeps": step.substeps, "scaling": step.damping_factor,
    }  # fmt: skip
    return {
        aspect: tuple(
            option
            for entry in entries
            for option in _options_of(aspect, entry | {"each": {
                name: _including(values, numbers.get(name))
                for name, values in entry.get("each", {}).items()
            }})
        )
        for aspect, entries in _TABLE.items()
    }  # fmt: skip


def _including(values: list[Any], declared: float | None) -> list[Any]:
    """Return values with the declared one; 1 has an entry of its own."""
    return values if declared in (None, 1) else sorted({*values, declared})


def declared(option: Option, step: Step) -> bool:
    """Return whether a choice is declared or left open by the greeting."""
    choice = option.fields[option.aspect]
    match option.aspect:
        case "integrator":
            return _declared_integrator(choice, step)
        case "substeps":
            return step.substeps in (None, choice)
        case "damper":
            return step.damper in (None, choice) or (step.damper, choice) == (
                "global_factor",
                "none",
            )
        case "pins":
            kinds = {"penalty": ("penalty", "springs"), "heavy": ("heavy", "weightless")}
            return step.pins is None or choice.split()[0] in kinds.get(step.pins, (step.pins,))
        case "velocity":  # explicit methods have no other velocity than their own
            own = step.method in ("explicit", "symplectic") and choice == "separate"
            return own or step.velocity in (None, choice)
        case "scaling" if step.damper in (None, "global_factor"):
            return step.damper is None or step.damping_factor in (None, choice)
    return bool(choice == 1.0)


def _declared_integrator(integrator: Integrator, step: Step) -> bool:
    iterative = integrator.method in ITERATIVE
    starts = {None: (integrator.start,), "y": ("y", "s_n")}  # many call s_n y
    if iterative and integrator.start not in starts.get(step.start, (step.start,)):
        return False
    if step.method == "linearised":
        return integrator.method == "newton" and integrator.iterations == 1
    if iterative and step.iterations not in (None, integrator.iterations):
        return False
    if integrator.method in SYMPLECTIC and step.method in (None, "symplectic"):
        return step.order in (None, SYMPLECTIC[integrator.method])
    unlimited = step.iterations is None and step.method in ITERATIVE
    return step.method in (None, integrator.method) or (
        unlimited and integrator.method == "converged"
    )


def declared_choices(step: Step) -> dict[str, list[Option]]:
    """Return, for each aspect, the honest choices that a greeting declares or leaves open."""
    choices = honest(step)
    return {a: [option for option in choices[a] if declared(option, step)] for a in ASPECTS}


def compatible(options: Mapping[str, Option]) -> bool:
    """Return whether choices make sense together, as far as they are made."""
    fields = {k: value for option in options.values() for k, value in option.fields.items()}
    damper, velocity = fields.get("damper"), fields.get("velocity")
    if "integrator" not in fields:
        return True
    method = fields["integrator"].method
    if damper in SYMPLECTIC_DAMPERS and method not in SYMPLECTIC:
        return False
    if damper and damper not in (EXPLICIT_DAMPERS if method in EXPLICIT else IMPLICIT_DAMPERS):
        return False
    own = ("explicit", "positions_first", "taylor", "runge_kutta")
    if velocity == "displacement" and method in own:
        return False
    return _are_few(fields, method)


def _are_few(fields: Mapping[str, Any], method: str) -> bool:
    """Return whether so many substeps are worth their time."""
    substeps = fields.get("substeps", 1)
    if method not in ("explicit", *SYMPLECTIC):
        return bool(substeps <= (30 if method in EXPLICIT else 20))
    usual = {"velocity": "separate", "scaling": 1.0}
    is_plain = all(fields.get(name, choice) == choice for name, choice in usual.items())
    return bool(substeps <= 30 or is_plain)
