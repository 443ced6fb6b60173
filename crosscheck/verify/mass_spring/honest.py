"""The choices that an honest solver may make, and which of them a greeting leaves open."""

from collections.abc import Mapping
from typing import Any

from ..greeting import Step
from ..sentence import Sentence, sentence
from .faults import ASPECTS, STEP_FAULTS, Option, options_of, read_table
from .model import EXPLICIT, Integrator

EXPLICIT_SUBSTEPS = (1, 2, 3, 4, 5, 8, 10, 16, 20, 30, 50, 100, 1000)
FREQUENT_SUBSTEPS = (1, 2, 3, 5, 10, 100, 1000)
LOCAL_GLOBAL_ITERATIONS = (1, 2, 3, 4, 5, 8, 10, 15, 20, 30, 50, 100)
NEWTON_ITERATIONS = (1, 2, 3, 4, 5, 10)
HESSIANS = ("exact", "gauss", "projected")
STARTS = ("x_n", "y")
SCALINGS = (0.9, 0.95, 0.98, 0.99, 0.995, 0.999)
# Dampers that explicit methods can have, and of these the ones that only symplectic Euler has.
EXPLICIT_DAMPERS = ("none", "explicit", "diagonal", "blocks", "matrix")
SYMPLECTIC_DAMPERS = ("diagonal", "blocks", "matrix")
IMPLICIT_DAMPERS = ("length_rate", "end_velocity", "explicit", "none")
_TABLE = read_table("honest.toml")
_WORDS = _TABLE.pop("words")
HONEST = {
    aspect: tuple(option for entry in entries for option in options_of(aspect, entry))
    for aspect, entries in _TABLE.items()
}


def _integrators(step: Step) -> tuple[Option, ...]:
    """Return the integrators known, the declared number of iterations among them."""
    local, newton = ({*counts, step.iterations or 1}
                     for counts in (LOCAL_GLOBAL_ITERATIONS, NEWTON_ITERATIONS))  # fmt: skip
    steps = [
        Integrator("newton", start, n, hessian)
        for n in sorted(newton) for start in STARTS for hessian in HESSIANS
    ]  # fmt: skip
    linearised = len(STARTS) * len(HESSIANS)
    return tuple(map(_integrator_option, (
        Integrator("converged", "y"), Integrator("symplectic"), Integrator("explicit"),
        *steps[:linearised],
        *(Integrator("local_global", start, n) for n in sorted(local) for start in STARTS),
        *steps[linearised:],
        Integrator("taylor"), Integrator("runge_kutta"),
    )))  # fmt: skip


def _integrator_option(integrator: Integrator) -> Option:
    name, start, n = integrator.method, integrator.start, integrator.iterations
    if name == "newton":
        name += f" {integrator.hessian}, {'one' if n == 1 else 'several'}"
    words, key = _WORDS[name], " ".join(map(str, integrator))
    message = Sentence(words["sentence"], {"n": n, "start": start})
    fields, rare = {"integrator": integrator}, words.get("rare", False)
    return Option(key, "integrator", message, fields=fields, rare=rare)


def _substeps(n: int) -> Option:
    message = sentence("one step") if n == 1 else sentence("{n} substeps", n=n)
    fields, rare = {"substeps": n}, n not in FREQUENT_SUBSTEPS
    return Option(f"substeps {n}", "substeps", message, fields=fields, rare=rare)


def _scaling(factor: float) -> Option:
    message = (
        sentence("velocities as they come")
        if factor == 1.0
        else sentence("velocities times {factor}", factor=factor)
    )
    fields, rare = {"scaling": factor}, factor != 1.0
    return Option(f"scaling {factor}", "scaling", message, fields=fields, rare=rare)


def honest(step: Step) -> dict[str, tuple[Option, ...]]:
    """Return, for each aspect, the honest choices, the usual choice first."""
    counts = sorted({*EXPLICIT_SUBSTEPS, step.substeps or 1})
    factors = dict.fromkeys((1.0, step.damping_factor or 1.0, *SCALINGS))
    return HONEST | {
        "integrator": _integrators(step),
        "substeps": tuple(map(_substeps, counts)),
        "scaling": tuple(map(_scaling, factors)),
    }


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
            kinds = {"penalty": ("penalty", "springs"), "heavy": ("heavy", "falling")}
            return step.pins is None or choice.split()[0] in kinds.get(step.pins, (step.pins,))
        case "velocity":  # explicit methods have no other velocity than their own
            own = step.method in ("explicit", "symplectic") and choice == "separate"
            return own or step.velocity in (None, choice)
        case "scaling" if step.damper in (None, "global_factor"):
            return step.damper is None or step.damping_factor in (None, choice)
    return bool(choice == 1.0)


def _declared_integrator(integrator: Integrator, step: Step) -> bool:
    iterative = integrator.method in ("newton", "local_global")
    if iterative and step.start not in (None, integrator.start):
        return False
    if step.method == "linearised":
        return integrator.method == "newton" and integrator.iterations == 1
    if iterative and step.iterations not in (None, integrator.iterations):
        return False
    unlimited = step.iterations is None and step.method in ("newton", "local_global")
    return step.method in (None, integrator.method) or (
        unlimited and integrator.method == "converged"
    )


def domains(step: Step) -> dict[str, list[tuple[Option, int]]]:
    """Return, for each aspect, all choices with their costs, cost 0 first."""
    right = honest(step)
    costs: dict[str, list[tuple[Option, int]]] = {}
    for aspect in ASPECTS:
        options = [(option, int(not declared(option, step))) for option in right.get(aspect, ())]
        if not options:
            options = [(Option("", aspect, sentence("as it should be")), 0)]
        options += [(fault, 1) for fault in STEP_FAULTS if fault.aspect == aspect]
        costs[aspect] = sorted(options, key=lambda pair: pair[1])
    return costs


def compatible(options: Mapping[str, Option]) -> bool:
    """Return whether choices make sense together, as far as they are made."""
    fields = {k: value for option in options.values() for k, value in option.fields.items()}
    damper, velocity = fields.get("damper"), fields.get("velocity")
    needs_substeps = (
        fields.get("pins") == "at_the_end"
        or fields.get("time") == "undivided"
        or velocity == "over the whole h"
    )
    if needs_substeps and fields.get("substeps") == 1:
        return False
    if "integrator" not in fields:
        return True
    method = fields["integrator"].method
    if method in EXPLICIT and ("matrix" in fields or fields.get("time") == "before"):
        return False
    if damper in SYMPLECTIC_DAMPERS and method != "symplectic":
        return False
    if damper and damper not in (EXPLICIT_DAMPERS if method in EXPLICIT else IMPLICIT_DAMPERS):
        return False
    if velocity == "displacement" and method in ("explicit", "taylor", "runge_kutta"):
        return False
    return _are_few(fields, method)


def _are_few(fields: Mapping[str, Any], method: str) -> bool:
    """Return whether so many substeps are worth their time."""
    substeps = fields.get("substeps", 1)
    if method not in ("explicit", "symplectic"):
        return bool(substeps <= (30 if method in EXPLICIT else 20))
    usual = {"velocity": "separate", "scaling": 1.0}
    plain = "time" not in fields and "inertia" not in fields
    plain &= all(fields.get(name, choice) == choice for name, choice in usual.items())
    return bool(substeps <= 30 or plain)
