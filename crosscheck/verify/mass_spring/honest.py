"""The choices that an honest solver may make, and which of them a greeting leaves open."""

from ..greeting import Step
from ..sentence import Sentence, sentence
from .faults import ASPECTS, STEP_FAULTS, Option
from .model import PIN_STRENGTHS, Integrator

EXPLICIT_SUBSTEPS = (1, 2, 3, 4, 5, 8, 10, 16, 20, 30, 50, 100, 1000)
SOLVER_ITERATIONS = (1, 2, 3, 4, 5, 8, 10, 15, 20, 30, 50, 100)
NEWTON_ITERATIONS = (2, 3, 4, 5, 10)
HESSIANS = ("exact", "gauss", "projected")
SCALINGS = (0.9, 0.95, 0.98, 0.99, 0.995, 0.999)
EXPLICIT_METHODS = ("explicit", "symplectic", "taylor", "runge_kutta", "in_place")
EXPLICIT_DAMPERS = ("none", "explicit", "diagonal", "blocks", "matrix")
IMPLICIT_DAMPERS = ("length_rate", "end_velocity", "explicit", "none")


def _integrator(said: Sentence, *values: object) -> Option:
    how = Integrator(*values)  # type: ignore[arg-type]
    return Option(" ".join(map(str, how)), "integrator", said, fields={"integrator": how})


def integrators(step: Step) -> list[Option]:
    """Return the integrators known, the declared number of iterations among them."""
    more = {step.iterations} if step.iterations else set()
    locals_, newtons = sorted({*SOLVER_ITERATIONS, *more}), sorted({*NEWTON_ITERATIONS, *more})
    return [
        _integrator(sentence("converged implicit Euler"), "converged", "y"),
        _integrator(sentence("symplectic Euler"), "symplectic"),
        _integrator(sentence("explicit Euler"), "explicit"),
        *(_linearised(start, kind) for start in ("x_n", "y") for kind in HESSIANS),
        *(_local_global(start, n) for n in locals_ for start in ("x_n", "y")),
        *(
            _newton(start, n, kind)
            for n in newtons
            if n > 1
            for start in ("x_n", "y")
            for kind in HESSIANS
        ),
        _integrator(sentence("x + h v + h²/2 a"), "taylor"),
        _integrator(sentence("the classical Runge-Kutta method"), "runge_kutta"),
    ]


def _linearised(start: str, kind: str) -> Option:
    said = {
        "exact": sentence("one linearised implicit step from {start}", start=start),
        "gauss": sentence(
            "one linearised implicit step from {start} without the geometric term of the Hessian",
            start=start,
        ),
        "projected": sentence(
            "one linearised implicit step from {start} with the geometric term only where springs "
            "are stretched",
            start=start,
        ),
    }[kind]
    return _integrator(said, "newton", start, 1, kind)


def _local_global(start: str, n: int) -> Option:
    said = sentence("{n} local/global iterations from {start}", n=n, start=start)
    return _integrator(said, "local_global", start, n)


def _newton(start: str, n: int, kind: str) -> Option:
    said = {
        "exact": sentence("{n} iterations of Newton's method from {start}", n=n, start=start),
        "gauss": sentence(
            "{n} Newton iterations from {start} without the geometric term", n=n, start=start
        ),
        "projected": sentence(
            "{n} Newton iterations from {start} with the geometric term only where springs are "
            "stretched",
            n=n,
            start=start,
        ),
    }[kind]
    return _integrator(said, "newton", start, n, kind)


DAMPERS = (
    Option("damper length_rate", "damper",
           sentence("dampers by the rate of their length"), fields={"damper": "length_rate"}),
    Option("damper explicit", "damper",
           sentence("explicit damping"), fields={"damper": "explicit"}),
    Option("damper none", "damper", sentence("no damping"), fields={"damper": "none"}),
    Option("damper end_velocity", "damper",
           sentence("dampers at the end velocity"), fields={"damper": "end_velocity"}),
    Option("damper diagonal", "damper",
           sentence("damping implicit in the diagonal of its matrix"),
           fields={"damper": "diagonal"}),
    Option("damper blocks", "damper",
           sentence("damping implicit in the 3 x 3 blocks of its matrix"),
           fields={"damper": "blocks"}),
    Option("damper matrix", "damper",
           sentence("implicit damping beside explicit springs"), fields={"damper": "matrix"}),
)  # fmt: skip


def _pins(key: str) -> Option:
    kind, strength = key.split()
    said = {
        "penalty": sentence("pins held by a penalty of {strength}", strength=strength),
        "springs": sentence("pins held by springs of {strength} N/m", strength=strength),
        "heavy": sentence("pins of {strength} kg", strength=strength),
        "falling": sentence("pins of {strength} kg that fall", strength=strength),
    }[kind]
    return Option("pins " + key, "pins", said, fields={"pins": key})


HONEST_PINS = (
    Option("pins eliminated", "pins", sentence("pins held inside the solve"),
           fields={"pins": "eliminated"}),
    Option("pins overwritten", "pins", sentence("pins put back after each solve"),
           fields={"pins": "overwritten"}),
    *(_pins(key) for key in PIN_STRENGTHS if key != "one kilogram"),
)  # fmt: skip
HONEST_VELOCITIES = (
    Option("velocity displacement", "velocity", sentence("velocities (x' - x) / h"),
           fields={"velocity": "displacement"}),
    Option("velocity separate", "velocity", sentence("velocities integrated beside"),
           fields={"velocity": "separate"}),
)  # fmt: skip


def _substeps(n: int) -> Option:
    said = sentence("one step") if n == 1 else sentence("{n} substeps", n=n)
    return Option(f"substeps {n}", "substeps", said, fields={"substeps": n})


def _scaling(factor: float) -> Option:
    said = (
        sentence("velocities as they come")
        if factor == 1.0
        else sentence("velocities times {factor}", factor=factor)
    )
    return Option(f"scaling {factor}", "scaling", said, fields={"scaling": factor})


def honest(step: Step) -> dict[str, list[Option]]:
    """Return, for each aspect, the choices that are no faults, the usual one first."""
    counts = sorted({*EXPLICIT_SUBSTEPS, step.substeps or 1})
    factors = [step.damping_factor] if step.damping_factor else []
    return {
        "integrator": integrators(step),
        "substeps": [_substeps(n) for n in counts],
        "damper": list(DAMPERS),
        "pins": list(HONEST_PINS),
        "velocity": list(HONEST_VELOCITIES),
        "scaling": [_scaling(factor) for factor in dict.fromkeys((1.0, *factors, *SCALINGS))],
    }


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
    if step.damper is None:
        return True
    if step.damper != "global_factor":
        return factor == 1.0
    return step.damping_factor is None or factor == step.damping_factor


def _declared_integrator(how: Integrator, step: Step) -> bool:
    if step.method is None:
        method = True
    elif step.method == "linearised":
        method = how.method == "newton" and how.iterations == 1
    else:
        method = how.method == step.method
        if step.iterations is None and step.method in ("newton", "local_global"):
            method = method or how.method == "converged"
    if how.method not in ("newton", "local_global"):
        return method
    counted = step.method == "linearised" or step.iterations in (None, how.iterations)
    return method and counted and step.start in (None, how.start)


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
    option = chosen.get("integrator", chosen.get("class"))
    how = option.fields["integrator"] if option else None
    substeps = chosen["substeps"].fields["substeps"] if "substeps" in chosen else None
    if how is not None:
        explicit = how.method in EXPLICIT_METHODS
        if explicit and chosen.get("matrix", _NONE).key:
            return False
        if explicit and chosen.get("time", _NONE).fields.get("time") == "before":
            return False
        damper = chosen.get("damper", _NONE).fields.get("damper")
        if damper in ("diagonal", "blocks", "matrix") and how.method != "symplectic":
            return False
        if damper and damper not in (EXPLICIT_DAMPERS if explicit else IMPLICIT_DAMPERS):
            return False
        if substeps and not _countable(chosen, how.method, substeps):
            return False
        own = explicit and how.method not in ("symplectic", "in_place")
        if own and chosen.get("velocity", _NONE).key == "velocity displacement":
            return False
    several = chosen.get("pins", _NONE).fields.get("pins") == "at_the_end"
    several |= chosen.get("time", _NONE).fields.get("time") == "undivided"
    several |= chosen.get("velocity", _NONE).fields.get("velocity") == "over the whole h"
    return not (several and substeps == 1)


def _countable(chosen: dict[str, Option], method: str, substeps: int) -> bool:
    """Return whether so many substeps are worth their time."""
    if method not in ("explicit", "symplectic"):
        return substeps <= (30 if method in EXPLICIT_METHODS else 20)
    plain = all(not chosen.get(one, _NONE).key for one in ("time", "inertia")) and chosen.get(
        "velocity", _NONE
    ).key in ("", "velocity separate")
    return substeps <= 30 or (
        plain and chosen.get("scaling", _NONE).fields.get("scaling", 1.0) == 1.0
    )


_NONE = Option("", "", sentence(""))
