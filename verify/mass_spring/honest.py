"""The choices of honest solvers, and the open choices of a greeting."""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from plumbob.text.sentence import Sentence

from ..greeting import Step
from .model import EXPLICIT, Integrator, Scaling, StepModel

# Aspects of a step in the order of the computation.
ASPECTS = ("damper", "integrator", "substeps", "pins", "velocity", "scaling")
# Symplectic Euler by the order of its updates.
SYMPLECTIC = {"symplectic": "velocities_first", "positions_first": "positions_first"}
# Methods with a number of iterations.
ITERATIVE = ("newton", "local_global")
# Kinds of pins by the word of a greeting; another word has the kind of its name.
PINS = {"penalty": ("penalty", "springs"), "heavy": ("heavy", "weightless", "falling")}
EXPLICIT_DAMPERS = ("none", "explicit")
IMPLICIT_DAMPERS = ("length_rate", "end_velocity", "explicit", "none")
# The classes of choices that have fields.
CLASSES: Mapping[str, Callable[..., Any]] = {"integrator": Integrator, "scaling": Scaling}
_TABLE = tomllib.loads(Path(__file__).with_name("honest.toml").read_text(encoding="utf-8"))


class Option(NamedTuple):
    """A choice of a solver in an aspect of a step."""

    aspect: str  # what it is a choice of; a solver makes one choice for each aspect
    sentence: Sentence  # what it does
    choice: Any  # the field of a model that has the aspect's name


def model_of(options: Sequence[Option]) -> StepModel:
    """Return the model of a solver with these options, without dampers unless one has them."""
    fields = {option.aspect: option.choice for option in options}
    return StepModel(damper="none")._replace(**fields)


def honest(step: Step, measured: Mapping[str, Sequence[Any]]) -> dict[str, tuple[Option, ...]]:
    """Return, for each aspect, the honest choices, the usual choice first.

    A number of a choice is the declared number, else one of those that answers show (`measured`, by
    name), else one of a table.
    """
    declared = {
        "iterations": step.iterations, "substeps": step.substeps, "factor": step.damping_factor,
    }  # fmt: skip
    # Declared pins that show no strength hold as strongly as this, by penalty or mass.
    numbers: dict[str, Sequence[Any]] = {kind: ["1e10"] for kind in PINS.get(step.pins or "", ())}
    numbers |= measured
    numbers |= {name: [n] for name, n in declared.items() if n not in (None, 1)}
    return {
        aspect: tuple(option for entry in entries for option in _options_of(aspect, entry, numbers))
        for aspect, entries in _TABLE.items()
    }


def _options_of(
    aspect: str, entry: Mapping[str, Any], numbers: Mapping[str, Sequence[Any]]
) -> Iterator[Option]:
    """Yield an option for each combination of the numbers in an entry's `each`."""
    own = {entry.get("measured", name): name for name in entry.get("each", {})}
    ranges = [numbers.get(key, entry["each"][name]) for key, name in own.items()]
    for chosen in product(*ranges):
        values = dict(zip(own.values(), chosen, strict=True))
        fixed = entry.get("value")
        if isinstance(fixed, dict):
            choice: Any = CLASSES[aspect](**fixed, **values)
        else:
            choice = fixed.format(**values) if isinstance(fixed, str) else values.get(aspect, fixed)
        yield Option(aspect, Sentence(entry["sentence"], values), choice)


def declared(option: Option, step: Step) -> bool:
    """Return whether a choice is declared or left open by the greeting."""
    choice = option.choice
    match option.aspect:
        case "integrator":
            return _declared_integrator(choice, step)
        case "substeps":
            return step.substeps in (None, choice)
        case "damper":
            return choice == ("none" if step.damper == "global_factor" else step.damper or choice)
        case "pins":
            return step.pins is None or choice.split()[0] in PINS.get(step.pins, (step.pins,))
        case "velocity":  # explicit methods have no other velocity than their own
            own = step.method in ("explicit", "symplectic") and choice == "separate"
            return own or step.velocity in (None, choice)
    if step.damper == "global_factor":
        return step.damping_factor in (None, choice.factor)
    # A factor that is not declared is recognised at the end alone, where it is a reservation.
    return choice == Scaling() or (step.damper is None and choice.place == "end")


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


def declared_choices(
    step: Step, measured: Mapping[str, Sequence[Any]] | None = None
) -> dict[str, list[Option]]:
    """Return, for each aspect, the honest choices that a greeting declares or leaves open."""
    choices = honest(step, measured or {})
    return {a: [option for option in choices[a] if declared(option, step)] for a in ASPECTS}


def compatible(options: Mapping[str, Option]) -> bool:
    """Return whether choices make sense together, as far as they are made."""
    if "integrator" not in options:
        return True
    model, method = model_of([*options.values()]), options["integrator"].choice.method
    is_explicit = method in EXPLICIT
    dampers = EXPLICIT_DAMPERS if is_explicit else IMPLICIT_DAMPERS
    places = ("start", "middle", "end") if method in ("explicit", *SYMPLECTIC) else ("start", "end")
    return (
        (model.damper in dampers or (model.damper == "matrix" and method in SYMPLECTIC))
        and model.scaling.place in places
        and not (is_explicit and model.pin_kind in PINS["penalty"])
        # the velocity that moves positions in symplectic Euler is its new one
        and not (is_explicit and method != "symplectic" and model.velocity == "displacement")
    )
