"""The choices that an honest solver may make, and which of them a greeting leaves open."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from plumbob.text.sentence import sentence

from ..greeting import Step
from .model import EXPLICIT, RIGHT_MATRIX, Integrator
from .options import ASPECTS, Option, options_of, read_table

# Symplectic Euler by the order of its updates.
SYMPLECTIC = {"symplectic": "velocities_first", "positions_first": "positions_first"}
# Methods with a number of iterations.
ITERATIVE = ("newton", "local_global")
# Dampers that explicit methods can have, and of these the ones that only symplectic Euler has.
EXPLICIT_DAMPERS = ("none", "explicit", "diagonal", "blocks", "matrix")
SYMPLECTIC_DAMPERS = ("diagonal", "blocks", "matrix")
IMPLICIT_DAMPERS = ("length_rate", "end_velocity", "explicit", "none")
_TABLE = read_table("honest.toml")


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
            for option in options_of(aspect, entry | {"each": {
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


def honest_domains(step: Step) -> dict[str, list[tuple[Option, int]]]:
    """Return, for each aspect, the honest choices with their costs, 1 if the greeting denies them.

    Those of cost 0 come first.
    """
    right, usual = honest(step), sentence("as it should be")
    domains = {
        aspect: [(option, int(not declared(option, step))) for option in right.get(aspect, ())]
        for aspect in ASPECTS
    }
    return {
        aspect: sorted(pairs, key=lambda pair: pair[1]) or [(Option("", aspect, usual), 0)]
        for aspect, pairs in domains.items()
    }


def compatible(options: Mapping[str, Option]) -> bool:
    """Return whether choices make sense together, as far as they are made."""
    fields = {k: value for option in options.values() for k, value in option.fields.items()}
    damper, velocity = fields.get("damper"), fields.get("velocity")
    if "substeps" in fields and fields["substeps"] < _least_substeps(fields):
        return False
    if "integrator" not in fields:
        return True
    method = fields["integrator"].method
    if method in EXPLICIT and ("matrix" in fields or fields.get("time") == "before"):
        return False
    is_linearised = fields["integrator"][:3] == ("newton", "x_n", 1)
    matrix = fields.get("matrix", RIGHT_MATRIX)
    is_for_linearised = fields.get("dv") or matrix.inverse == "first order"
    is_for_local_global = matrix.pins_element is not None
    if (is_for_linearised and not is_linearised) or (
        is_for_local_global and method != "local_global"
    ):
        return False
    parts = {option.part for option in options.values()} - {"", "both"}
    if method in EXPLICIT and (parts or ("update" in fields and method != "symplectic")):
        return False
    if fields.get("dampers_apart") and "matrix" not in fields:
        return False
    if damper in SYMPLECTIC_DAMPERS and method not in SYMPLECTIC:
        return False
    if damper and damper not in (EXPLICIT_DAMPERS if method in EXPLICIT else IMPLICIT_DAMPERS):
        return False
    own = ("explicit", "positions_first", "taylor", "runge_kutta")
    if velocity == "displacement" and method in own:
        return False
    return _are_few(fields, method)


def _least_substeps(fields: Mapping[str, Any]) -> int:
    """Return the number of substeps below which a choice is another one."""
    if fields.get("time") == "one substep less":
        return 3  # one of two would be half of h
    needs_several = (
        fields.get("pins") == "at_the_end"
        or fields.get("time") == "undivided"
        or fields.get("keeps_forces")
        or fields.get("velocity") == "d / whole"
    )
    return 2 if needs_several else 1


def _are_few(fields: Mapping[str, Any], method: str) -> bool:
    """Return whether so many substeps are worth their time."""
    substeps = fields.get("substeps", 1)
    if method not in ("explicit", *SYMPLECTIC):
        return bool(substeps <= (30 if method in EXPLICIT else 20))
    usual = {"velocity": "separate", "scaling": 1.0}
    plain = not fields.keys() & {"time", "keeps_forces"} and "inertia" not in fields
    plain &= all(fields.get(name, choice) == choice for name, choice in usual.items())
    return bool(substeps <= 30 or plain)
