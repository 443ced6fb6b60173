"""The choices that an honest solver may make, and which of them a greeting leaves open."""

from collections.abc import Mapping
from typing import Any

from ..greeting import Step
from ..sentence import Sentence, sentence
from .faults import ASPECTS, STEP_FAULTS, Option, choices_of
from .model import PIN_STRENGTHS, Integrator

EXPLICIT_SUBSTEPS = (1, 2, 3, 4, 5, 8, 10, 16, 20, 30, 50, 100, 1000)
SOLVER_ITERATIONS = (1, 2, 3, 4, 5, 8, 10, 15, 20, 30, 50, 100)
NEWTON_ITERATIONS = (2, 3, 4, 5, 10)
SCALINGS = (0.9, 0.95, 0.98, 0.99, 0.995, 0.999)
EXPLICIT_METHODS = ("explicit", "symplectic", "taylor", "runge_kutta", "in_place")
EXPLICIT_DAMPERS = ("none", "explicit", "diagonal", "blocks", "matrix")
IMPLICIT_DAMPERS = ("length_rate", "end_velocity", "explicit", "none")


_KINDS = {
    "exact": (sentence("one linearised implicit step from {start}"),
              sentence("{n} iterations of Newton's method from {start}")),
    "gauss": (sentence("one linearised implicit step from {start} without the geometric term of "
                       "the Hessian"),
              sentence("{n} Newton iterations from {start} without the geometric term")),
    "projected": (sentence("one linearised implicit step from {start} with the geometric term "
                           "only where springs are stretched"),
                  sentence("{n} Newton iterations from {start} with the geometric term only where "
                           "springs are stretched")),
}  # fmt: skip


def _integrator(said: Sentence, *values: Any) -> Option:
    how = Integrator(*values)
    return Option(" ".join(map(str, how)), "integrator", said, fields={"integrator": how})


def integrators(step: Step) -> list[Option]:
    """Return the integrators known, the declared number of iterations among them."""
    more = {step.iterations} if step.iterations else set()
    locals_, newtons = sorted({*SOLVER_ITERATIONS, *more}), sorted({*NEWTON_ITERATIONS, *more})
    return [
        _integrator(sentence("converged implicit Euler"), "converged", "y"),
        _integrator(sentence("symplectic Euler"), "symplectic"),
        _integrator(sentence("explicit Euler"), "explicit"),
        *(_newton(start, 1, kind) for start in ("x_n", "y") for kind in _KINDS),
        *(_local_global(start, n) for n in locals_ for start in ("x_n", "y")),
        *(_newton(start, n, kind)
          for n in newtons if n > 1 for start in ("x_n", "y") for kind in _KINDS),
        _integrator(sentence("x + h v + h²/2 a"), "taylor"),
        _integrator(sentence("the classical Runge-Kutta method"), "runge_kutta"),
    ]  # fmt: skip


def _newton(start: str, n: int, kind: str) -> Option:
    words = {"start": start} if n == 1 else {"n": n, "start": start}
    said = _KINDS[kind][n > 1]
    return _integrator(Sentence(said.template, words), "newton", start, n, kind)


def _local_global(start: str, n: int) -> Option:
    said = sentence("{n} local/global iterations from {start}", n=n, start=start)
    return _integrator(said, "local_global", start, n)


DAMPERS = choices_of("damper", {
    "length_rate": sentence("dampers by the rate of their length"),
    "explicit": sentence("explicit damping"),
    "none": sentence("no damping"),
    "end_velocity": sentence("dampers at the end velocity"),
    "diagonal": sentence("damping implicit in the diagonal of its matrix"),
    "blocks": sentence("damping implicit in the 3 x 3 blocks of its matrix"),
    "matrix": sentence("implicit damping beside explicit springs"),
})  # fmt: skip
_PINS = {
    "penalty": sentence("pins held by a penalty of {strength}"),
    "springs": sentence("pins held by springs of {strength} N/m"),
    "heavy": sentence("pins of {strength} kg"),
    "falling": sentence("pins of {strength} kg that fall"),
}
HONEST_PINS = choices_of("pins", {
    "eliminated": sentence("pins held inside the solve"),
    "overwritten": sentence("pins put back after each solve"),
    **{key: Sentence(_PINS[key.split()[0]].template, {"strength": key.split()[1]})
       for key in PIN_STRENGTHS if key != "one kilogram"},
})  # fmt: skip
HONEST_VELOCITIES = choices_of("velocity", {
    "displacement": sentence("velocities (x' - x) / h"),
    "separate": sentence("velocities integrated beside"),
})  # fmt: skip


def honest(step: Step) -> dict[str, tuple[Option, ...]]:
    """Return, for each aspect, the choices that are no faults, the usual one first."""
    counts = sorted({*EXPLICIT_SUBSTEPS, step.substeps or 1})
    factors = [step.damping_factor] if step.damping_factor else []
    return {
        "integrator": tuple(integrators(step)),
        "substeps": choices_of("substeps", {
            n: sentence("one step") if n == 1 else sentence("{n} substeps", n=n) for n in counts
        }),
        "damper": DAMPERS,
        "pins": HONEST_PINS,
        "velocity": HONEST_VELOCITIES,
        "scaling": choices_of("scaling", {
            1.0: sentence("velocities as they come"),
            **{factor: sentence("velocities times {factor}", factor=factor)
               for factor in (*factors, *SCALINGS)},
        }),
    }  # fmt: skip


def declared(option: Option, step: Step) -> bool:
    """Return whether a choice is within what the greeting declares or leaves open."""
    fields = option.fields
    match option.aspect:
        case "integrator":
            return _declared_integrator(fields["integrator"], step)
        case "substeps":
            return step.substeps is None or step.substeps == fields["substeps"]
        case "damper":
            wanted = "none" if step.damper == "global_factor" else step.damper
            return wanted is None or wanted == fields["damper"]
        case "pins":
            return step.pins is None or fields["pins"] in _pins_of(step.pins)
        case "velocity":  # explicit methods have no other velocity than their own
            own = step.method in ("explicit", "symplectic") and fields["velocity"] == "separate"
            return own or step.velocity in (None, fields["velocity"])
        case "scaling":
            return _declared_scaling(fields["scaling"], step)
    return False


def _pins_of(kind: str) -> tuple[str, ...]:
    names = {"penalty": ("penalty", "springs"), "heavy": ("heavy", "falling")}.get(kind, (kind,))
    return tuple(key for key in (*PIN_STRENGTHS, kind) if key.split()[0] in names)


def _declared_scaling(factor: float, step: Step) -> bool:
    if step.damper not in (None, "global_factor"):
        return factor == 1.0
    return step.damper is None or step.damping_factor in (None, factor)


def _declared_integrator(how: Integrator, step: Step) -> bool:
    iterative = how.method in ("newton", "local_global")
    if iterative and step.start not in (None, how.start):
        return False
    if step.method == "linearised":
        return how.method == "newton" and how.iterations == 1
    if iterative and step.iterations not in (None, how.iterations):
        return False
    unlimited = step.iterations is None and step.method in ("newton", "local_global")
    return step.method in (None, how.method) or (unlimited and how.method == "converged")


def domains(step: Step) -> dict[str, list[tuple[Option, int]]]:
    """Return, for each aspect, all choices with their costs: those of cost 0 first."""
    right = honest(step)
    found: dict[str, list[tuple[Option, int]]] = {}
    for aspect in ASPECTS:
        options = [(one, 0 if declared(one, step) else 1) for one in right.get(aspect, ())]
        if not options:
            options = [(Option("", aspect, sentence("as it should be")), 0)]
        options += [(one, 1) for one in STEP_FAULTS if one.aspect == aspect]
        found[aspect] = sorted(options, key=lambda pair: pair[1])
    return found


def compatible(chosen: dict[str, Option]) -> bool:
    """Return whether choices make sense together, as far as they are made."""
    fields = {k: value for option in chosen.values() for k, value in option.fields.items()}
    how, damper, velocity = (fields.get(name) for name in ("integrator", "damper", "velocity"))
    needs_several = (
        fields.get("pins") == "at_the_end"
        or fields.get("time") == "undivided"
        or velocity == "over the whole h"
    )
    if needs_several and fields.get("substeps") == 1:
        return False
    if how is None:
        return True
    explicit = how.method in EXPLICIT_METHODS
    if explicit and ("matrix" in fields or fields.get("time") == "before"):
        return False
    if damper in ("diagonal", "blocks", "matrix") and how.method != "symplectic":
        return False
    if damper and damper not in (EXPLICIT_DAMPERS if explicit else IMPLICIT_DAMPERS):
        return False
    own = explicit and how.method not in ("symplectic", "in_place")
    if own and velocity == "displacement":
        return False
    return _countable(fields, how.method)


def _countable(fields: Mapping[str, Any], method: str) -> bool:
    """Return whether so many substeps are worth their time."""
    substeps = fields.get("substeps", 1)
    if method not in ("explicit", "symplectic"):
        return substeps <= (30 if method in EXPLICIT_METHODS else 20)
    plain = "time" not in fields and "inertia" not in fields
    plain &= fields.get("velocity", "separate") == "separate"
    return substeps <= 30 or (plain and fields.get("scaling", 1.0) == 1.0)
