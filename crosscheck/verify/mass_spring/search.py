"""Find what a solver does by assuming one choice after another along the probes.

In each probe one more aspect matters than in those before it. Choices are therefore refuted where
they first matter, so that combinations of three among some hundred faults and as many honest models
are found without trying the millions that there are.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ..contestant import Answer, Exchange
from ..greeting import Step
from .faults import ASPECTS, INTEGRATORS, Option, apply
from .honest import compatible, domains
from .model import PIN_STRENGTHS, Integrator, StepModel, predicted
from .problem import SpringProblem
from .rounding import SOLVED, Rounding, apart, rounding

MOST_FAULTS = 3
# Seconds of the processor for honest choices, one fault, two, and three.
PATIENCE = (6.0, 6.0, 3.0, 3.0)
# Integrators with more iterations are not combined with faults.
MOST_ITERATIONS = 10
# Matrices that are singular without pins, where they predict nothing.
SINGULAR = ("matrix L", "matrix L without h²")
# Positions beyond this [m] come from dividing by zero; those of the probes are some metres.
ABSURD = 1e4
FAULTY = frozenset(id(one) for one in INTEGRATORS)
# Of what is not declared, only these are tried together with faults.
FREQUENT = (
    1, 2, 3, 5, 10, 100, 1000, "penalty 1e10", "springs 5e5", "heavy 1e8", "falling 1e8",
    "one kilogram",
)  # fmt: skip
# Aspects that matter in any step; the others where there are springs, dampers, pins.
ALWAYS = (
    "time", "inertia", "masses", "gravity", "integrator", "matrix", "substeps", "velocity",
    "scaling",
)  # fmt: skip

Chosen = dict[str, Option]


class Found(NamedTuple):
    """Choices that reproduce the answers to all probes."""

    # one for each aspect that matters in a probe, in the order of the computation
    options: tuple[Option, ...]
    faults: tuple[Option, ...]  # those of them that the greeting denies, or that nobody should make


class Probe(NamedTuple):
    """A problem, and what was answered."""

    problem: SpringProblem
    answered: Mapping[str, Any]
    name: str


class Search:
    """The search of the choices that explain a solver's answers to the probes."""

    def __init__(self, probes: Sequence[Probe], step: Step, epsilon: float) -> None:
        """Set up the domains of all choices."""
        self.probes, self.step, self.epsilon = probes, step, epsilon
        self.domains = domains(step)
        self.classes, self.members = _classes(self.domains["integrator"])
        pairs = [*chain.from_iterable(self.domains.values()), *self.classes]
        self.costs = {id(option): cost for option, cost in pairs}
        self.tried = 0
        self._misplaced: set[tuple[Any, ...]] = set()
        self._roundings: dict[tuple[Any, ...], Rounding] = {}
        self._known: dict[tuple[Any, ...], bool | None] = {}
        self._seen: set[tuple[str, ...]] = set()
        self._until = 0.0

    def run(self) -> list[Found]:
        """Return what explains all probes with the fewest faults; none if nothing does."""
        for budget in range(MOST_FAULTS + 1) if self.probes else ():
            self._until = time.process_time() + PATIENCE[budget]
            found = [one for one in self._extend({}, 0, budget) if len(one.faults) == budget]
            if found:
                return found
        return []

    def _extend(self, chosen: Chosen, index: int, budget: int) -> Iterator[Found]:
        """Yield what explains the probes from this one on, given the choices made before."""
        if index == len(self.probes):
            if self._explains_most(chosen):
                found = self._found(chosen)
                self._seen.add(_keys(found))
                yield found
            return
        known = {*chosen, "integrator"} if "class" in chosen else chosen
        new = [one for one in _relevant(self.probes[index].problem) if one not in known]
        springs = _has_springs(self.probes[index].problem)
        for more in self._choices(chosen, new, budget, springs):
            if self._told(more):
                continue
            if time.process_time() > self._until:
                return
            if self._explains(more, index) is not False:
                yield from self._extend(more, index + 1, budget)

    def _told(self, chosen: Chosen) -> bool:
        """Return whether the same faults explain all probes with other honest choices already."""
        if not self._seen or "class" in chosen:
            return False
        return _keys(self._found(chosen)) in self._seen

    def _explains_most(self, chosen: Chosen) -> bool:
        """Return whether no more than a few answers are left out because of singular matrices."""
        explained = [self._explains(chosen, i) for i in range(len(self.probes))]
        return 2 * sum(one is True for one in explained) >= min(4, len(explained))

    def _choices(
        self, chosen: Chosen, new: Sequence[str], budget: int, springs: bool
    ) -> Iterator[Chosen]:
        """Yield the choices extended by those of the aspects that now matter."""
        if springs and "class" in chosen:
            others = {key: value for key, value in chosen.items() if key != "class"}
            for option in self.members[chosen["class"].fields["integrator"]]:
                if not self._tedious(option, budget):
                    yield from self._choices(others | {"integrator": option}, new, budget, springs)
            return
        left = budget - sum(self.costs[id(option)] for option in chosen.values())
        if left < 0 or not compatible(chosen):
            return
        if not new:
            yield chosen
            return
        aspect, *remaining = new
        options = self.domains[aspect]
        if aspect == "integrator" and not springs:
            options, aspect = self.classes, "class"
        for option, cost in options:
            if cost <= left and not self._tedious(option, budget):
                yield from self._choices(chosen | {aspect: option}, remaining, budget, springs)

    def _tedious(self, option: Option, budget: int) -> bool:
        """Return whether a choice is not tried together with so many faults."""
        return (
            (budget > 0 and self._guessed(option))
            or (budget > 1 and self.costs[id(option)] > 0 and _takes_long(option))
            or (budget > 2 and option.key in SINGULAR)
        )

    def _guessed(self, option: Option) -> bool:
        """Return whether a choice is honest, rare, and nowhere declared."""
        value, step = option.fields.get(option.aspect), self.step
        match option.aspect:
            case "scaling":
                return step.damper is None and value != 1.0
            case "substeps":
                return step.substeps is None and value not in FREQUENT
            case "damper":
                return step.damper is None and value in ("diagonal", "blocks", "matrix")
            case "pins":
                return value in PIN_STRENGTHS and value not in FREQUENT
            case "integrator":
                how = option.fields["integrator"]
                return how.method in ("taylor", "runge_kutta") or how.hessian == "projected"
        return False

    def _explains(self, chosen: Chosen, index: int) -> bool | None:
        """Return whether choices reproduce an answer; None where neither is a number of use."""
        probe = self.probes[index]
        in_springs = _has_springs(probe.problem)
        matters = chosen if in_springs else _in_flight_only(chosen)
        centre = not in_springs and chosen["matrix"].key.startswith("matrix without k")
        key = ((index, centre), *sorted((aspect, id(one)) for aspect, one in matters.items()))
        place = tuple(one for one in key if one[0] != "velocity") if _once(matters) else key
        if place in self._misplaced:
            return False
        if key not in self._known:
            options = tuple(matters.values())
            if centre:
                self._known[key] = self._compare_centre(options, probe)
            else:
                self.tried += 1
                self._known[key], there = self._compare(options, probe)
                if not there:
                    self._misplaced.add(place)
        return self._known[key]

    def _compare_centre(self, options: tuple[Option, ...], probe: Probe) -> bool | None:
        """Return False where the centre of mass is elsewhere, else None.

        A matrix without stiffness joins particles even where their spring has none, differently
        for each integrator, but leaves their centre where it is.
        """
        problem, model = apply(options, probe.problem, StepModel(damper="none"))
        x, _ = predicted(problem, model).values()
        share = problem.masses / problem.masses.sum()
        centre = {"positions": share @ x, "velocities": np.zeros(0)}
        answered = {"positions": share @ probe.answered["positions"]}
        whole = probe.problem.changed(positions=share @ probe.problem.positions)
        error = apart(whole, centre, answered, self._rounding(probe, model))
        return None if error <= SOLVED else False

    def _rounding(self, probe: Probe, model: StepModel) -> Rounding:
        key = probe.name, model.substeps, model.integrator.explicit
        if key not in self._roundings:
            self._roundings[key] = rounding(probe.problem, model, self.epsilon)
        return self._roundings[key]

    def _compare(self, options: tuple[Option, ...], probe: Probe) -> tuple[bool | None, bool]:
        """Return whether an answer is reproduced, and whether its positions may be."""
        problem, model = apply(options, probe.problem, StepModel(damper="none"))
        values, answered = predicted(problem, model), probe.answered
        if _absurd(values):  # a singular matrix predicts nothing but that
            return (None if _absurd(answered) else False), True
        allowed = self._rounding(probe, model)
        same = apart(probe.problem, values, answered, allowed) <= SOLVED
        if same or problem.steps or "positions" not in answered:
            return bool(same), True
        places = {"positions": answered["positions"]}
        return False, bool(apart(probe.problem, values, places, allowed) <= SOLVED)

    def _found(self, chosen: Chosen) -> Found:
        if "class" in chosen:
            option = self.members[chosen["class"].fields["integrator"]][0]
            chosen = {**chosen, "integrator": option}
        options = tuple(chosen[one] for one in ASPECTS if one in chosen)
        return Found(options, tuple(one for one in options if self.costs[id(one)]))


def _absurd(values: Mapping[str, Any]) -> bool:
    """Return whether positions are those that a singular matrix gives."""
    return "positions" not in values or not np.abs(values["positions"]).max() < ABSURD


def _once(chosen: Chosen) -> bool:
    """Return whether there is one substep, so that velocities do not enter positions."""
    return "substeps" in chosen and chosen["substeps"].fields["substeps"] == 1


def _takes_long(option: Option) -> bool:
    """Return whether a choice is not tried together with other faults.

    These are integrators that take long, and those, as well as numbers of substeps, that are honest
    but denied by the greeting.
    """
    how = option.fields.get("integrator")
    if how is None:
        return option.aspect in ("substeps", "scaling")
    denied = id(option) not in FAULTY
    return denied or how.method == "descent" or how.iterations > MOST_ITERATIONS


def _classes(
    integrators: Sequence[tuple[Option, int]],
) -> tuple[list[tuple[Option, int]], dict[Integrator, list[Option]]]:
    """Return one integrator of each class that flight does not tell apart, and all of them."""
    classes: dict[Integrator, tuple[Option, int]] = {}
    members: dict[Integrator, list[Option]] = {}
    for option, cost in integrators:
        how = in_flight(option.fields["integrator"])
        members.setdefault(how, []).append(option)
        first, least = classes.get(how, (option._replace(fields={"integrator": how}), cost))
        classes[how] = first, min(least, cost)
    return list(classes.values()), members


def _in_flight_only(chosen: Chosen) -> Chosen:
    """Return those choices that matter where no spring acts."""
    mattering = (*SINGULAR, "matrix 2M+h²L")
    return {
        aspect: option
        for aspect, option in chosen.items()
        if not (aspect == "matrix" and option.key not in mattering)
        and not (aspect == "time" and option.fields.get("time") == "before")
    }


def in_flight(how: Integrator) -> Integrator:
    """Return an integrator that moves free particles alike: without springs g is quadratic."""
    if how.explicit or how.method == "descent":
        return how
    if how.method == "newton" and how.rate != 1.0:
        return how._replace(hessian="gauss")
    return Integrator("newton", "x_n", 1, "gauss")


def _has_springs(p: SpringProblem) -> bool:
    return bool(p.stiffnesses.any() or p.dampings.any())


def _relevant(p: SpringProblem) -> list[str]:
    """Return the aspects that matter in a problem, in the order in which they are chosen."""
    springs = ["springs"] if p.stiffnesses.any() else []
    dampers = ["damper", "damping"] if p.dampings.any() else []
    pins = ["pins"] if len(p.pinned) else []
    return [*ALWAYS, *springs, *dampers, *pins]


def _keys(found: Found) -> tuple[str, ...]:
    return tuple(fault.key for fault in found.faults)


def probes_of(
    asked: Sequence[Exchange], problems: Mapping[str, SpringProblem], every: bool = False
) -> list[Probe]:
    """Return the probes, or every case, that were answered, in their order."""
    return [
        Probe(problems[one.case.name], one.answer.values, one.case.name)
        for one in asked
        if isinstance(one.answer, Answer) and (every or one.case.facts.get("probe"))
    ]
