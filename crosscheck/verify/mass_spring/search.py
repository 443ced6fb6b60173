"""Find what a solver does by assuming one choice after another along the probes.

In each probe one more aspect matters than in those before it. Choices are therefore refuted where
they first matter, so that combinations of three among some hundred faults and as many honest models
are found without trying the millions that there are.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..contestant import Answer, Asked
from ..greeting import Step
from .faults import ASPECTS, INTEGRATORS, Option, apply
from .honest import compatible, domains
from .model import PIN_STRENGTHS, Integrator, Model, simulate
from .problem import Problem
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
    """Choices that reproduce the answers to all probes.

    Attributes:
        options: one for each aspect that matters in a probe, in the order of the computation.
        faults: those of them that the greeting denies, or that nobody should make.
    """

    options: tuple[Option, ...]
    faults: tuple[Option, ...]


class Probe(NamedTuple):
    """A problem, and what was answered."""

    problem: Problem
    answered: Mapping[str, Any]
    name: str


class Search:
    """The search of the choices that explain a solver's answers to the probes."""

    def __init__(self, probes: Sequence[Probe], step: Step, epsilon: float) -> None:
        """Set up the domains of all choices."""
        self.probes = probes
        self.step = step
        self.domains = domains(step)
        self.costs = {
            (aspect, option.key, _how(option)): cost
            for aspect, pairs in self.domains.items()
            for option, cost in pairs
        }
        self.epsilon = epsilon
        self._class_costs: dict[Integrator, int] = {}
        self.classes, self.members = _classes(self.domains["integrator"])
        self.tried = 0
        self._misplaced: set[tuple[Any, ...]] = set()
        self._roundings: dict[tuple[Any, ...], Rounding] = {}
        self._known: dict[tuple[Any, ...], bool | None] = {}
        self.farthest = -1
        self._seen: set[tuple[str, ...]] = set()
        self._until = 0.0

    def run(self) -> list[Found]:
        """Return what explains all probes with the fewest faults; none if nothing does."""
        if not self.probes:
            return []
        for budget in range(MOST_FAULTS + 1):
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
        probe = self.probes[index]
        known = {*chosen, "integrator"} if "class" in chosen else chosen
        new = [one for one in _relevant(probe.problem) if one not in known]
        springs = _has_springs(probe.problem)
        for more in self._choices(chosen, new, budget, springs):
            if self._told(more):
                continue
            if time.process_time() > self._until:
                return
            explained = self._explains(more, index)
            if explained:
                self.farthest = max(self.farthest, index)
            if explained or explained is None:
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
            for option in self.members[chosen["class"].fields["integrator"]]:
                denied = self.costs["integrator", option.key, _how(option)]
                if (denied and budget > 1 and _tedious(option)) or (
                    budget > 0 and self._guessed(option)
                ):
                    continue
                rest = {key: value for key, value in chosen.items() if key != "class"}
                yield from self._choices(rest | {"integrator": option}, new, budget, springs)
            return
        left = budget - self._cost(chosen)
        if left < 0 or not compatible(chosen):
            return
        if not new:
            yield chosen
            return
        aspect, *others = new
        if aspect == "integrator" and not springs:
            options, aspect = [(one, self._class_cost(one)) for one in self.classes], "class"
            others = [one for one in others if one != "integrator"]
        else:
            options = self.domains[aspect]
        for option, cost in options:
            tedious = bool(cost) and budget > 1 and _tedious(option)
            tedious |= budget > 2 and option.key in SINGULAR
            tedious |= budget > 0 and self._guessed(option)
            if cost <= left and not tedious:
                yield from self._choices(chosen | {aspect: option}, others, budget, springs)

    def _guessed(self, option: Option) -> bool:
        """Return whether a choice is honest, rare, and nowhere declared."""
        fields, step = option.fields, self.step
        match option.aspect:
            case "scaling":
                return step.damper is None and fields["scaling"] != 1.0
            case "substeps":
                return step.substeps is None and fields["substeps"] not in FREQUENT
            case "damper":
                return step.damper is None and fields["damper"] in ("diagonal", "blocks", "matrix")
            case "pins":
                return fields["pins"] in PIN_STRENGTHS and fields["pins"] not in FREQUENT
            case "integrator":
                how = fields["integrator"]
                return how.method in ("taylor", "runge_kutta") or how.hessian == "projected"
        return False

    def _cost(self, chosen: Chosen) -> int:
        return sum(
            self._class_cost(option)
            if aspect == "class"
            else self.costs[aspect, option.key, _how(option)]
            for aspect, option in chosen.items()
        )

    def _class_cost(self, option: Option) -> int:
        how = option.fields["integrator"]
        if how not in self._class_costs:
            costs = [self.costs["integrator", one.key, _how(one)] for one in self.members[how]]
            self._class_costs[how] = min(costs)
        return self._class_costs[how]

    def _explains(self, chosen: Chosen, index: int) -> bool | None:
        """Return whether choices reproduce an answer; None where neither is a number of use."""
        probe = self.probes[index]
        matters = chosen
        if not _has_springs(probe.problem):
            matters = _in_flight_only(chosen)
            if chosen["matrix"].key.startswith("matrix without k"):
                return self._centre_explained(matters, index)
        key = ((index,), *sorted((aspect, id(option)) for aspect, option in matters.items()))
        place = tuple(one for one in key if one[:1] != ("velocity",)) if _once(matters) else key
        if place in self._misplaced:
            return False
        if key not in self._known:
            self.tried += 1
            self._known[key], there = self._compare(tuple(matters.values()), probe)
            if not there:
                self._misplaced.add(place)
        return self._known[key]

    def _centre_explained(self, chosen: Chosen, index: int) -> bool | None:
        """Return False where the centre of mass is elsewhere, else None.

        A matrix without stiffness joins particles even where their spring has none, differently
        for each integrator, but leaves their centre where it is.
        """
        key = ((-1 - index,), *sorted((aspect, id(option)) for aspect, option in chosen.items()))
        if key not in self._known:
            probe = self.probes[index]
            problem, model = apply(tuple(chosen.values()), probe.problem, Model(damper="none"))
            with np.errstate(all="ignore"):
                predicted = simulate(problem, model)
            share = problem.masses / problem.masses.sum()
            centre = {"positions": share @ predicted["positions"], "velocities": np.zeros(0)}
            answered = {"positions": share @ probe.answered["positions"]}
            allowed = self._rounding(probe, model)
            whole = probe.problem.changed(positions=share @ probe.problem.positions)
            close = apart(whole, centre, answered, allowed) <= SOLVED
            self._known[key] = None if close else False
        return self._known[key]

    def _rounding(self, probe: Probe, model: Model) -> Rounding:
        key = probe.name, model.substeps, model.integrator.explicit
        if key not in self._roundings:
            self._roundings[key] = rounding(probe.problem, model, self.epsilon)
        return self._roundings[key]

    def _compare(self, options: tuple[Option, ...], probe: Probe) -> tuple[bool | None, bool]:
        """Return whether an answer is reproduced, and whether its positions may be."""
        problem, model = apply(options, probe.problem, Model(damper="none"))
        with np.errstate(all="ignore"):
            try:
                predicted = simulate(problem, model)
            except np.linalg.LinAlgError:
                predicted = {}
        if _absurd(predicted):  # a singular matrix predicts nothing but that
            return (None if _absurd(probe.answered) else False), True
        allowed = self._rounding(probe, model)
        same = apart(probe.problem, predicted, probe.answered, allowed) <= SOLVED
        if same or problem.steps or "positions" not in probe.answered:
            return bool(same), True
        places = {"positions": probe.answered["positions"]}
        return False, bool(apart(probe.problem, predicted, places, allowed) <= SOLVED)

    def _found(self, chosen: Chosen) -> Found:
        if "class" in chosen:
            option = self.members[chosen["class"].fields["integrator"]][0]
            chosen = {**chosen, "integrator": option}
        options = tuple(chosen[one] for one in ASPECTS if one in chosen)
        faults = tuple(one for one in options if self.costs[one.aspect, one.key, _how(one)])
        return Found(options, faults)


def _absurd(values: Mapping[str, Any]) -> bool:
    """Return whether positions are those that a singular matrix gives."""
    return "positions" not in values or not np.abs(values["positions"]).max() < ABSURD


def _once(chosen: Chosen) -> bool:
    """Return whether there is one substep, so that velocities do not enter positions."""
    return "substeps" in chosen and chosen["substeps"].fields["substeps"] == 1


def _tedious(option: Option) -> bool:
    """Return whether a choice is not tried together with other faults.

    These are integrators that take long, and those, as well as numbers of substeps, that are honest
    but denied by the greeting.
    """
    how = _how(option)
    if how is None:
        return option.aspect in ("substeps", "scaling")
    denied = id(option) not in FAULTY
    return denied or how.method == "descent" or how.iterations > MOST_ITERATIONS


def _classes(
    integrators: Sequence[tuple[Option, int]],
) -> tuple[list[Option], dict[Integrator, list[Option]]]:
    """Return one integrator of each class that flight does not tell apart, and all of them."""
    members: dict[Integrator, list[Option]] = {}
    for option, _ in integrators:
        members.setdefault(in_flight(option.fields["integrator"]), []).append(option)
    return [one[0]._replace(fields={"integrator": how}) for how, one in members.items()], members


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


def _how(option: Option) -> Any:
    return option.fields.get("integrator")


def _has_springs(p: Problem) -> bool:
    return bool(p.stiffnesses.any() or p.dampings.any())


def _relevant(p: Problem) -> list[str]:
    """Return the aspects that matter in a problem, in the order in which they are chosen."""
    springs = ["springs"] if p.stiffnesses.any() else []
    dampers = ["damper", "damping"] if p.dampings.any() else []
    pins = ["pins"] if len(p.pinned) else []
    return [*ALWAYS, *springs, *dampers, *pins]


def _keys(found: Found) -> tuple[str, ...]:
    return tuple(fault.key for fault in found.faults)


def probes_of(asked: Sequence[Asked], problems: Mapping[str, Problem]) -> list[Probe]:
    """Return the probes that were answered, in their order."""
    return [
        Probe(problems[one.case.name], one.answer.values, one.case.name)
        for one in asked
        if one.case.facts.get("probe") and isinstance(one.answer, Answer)
    ]
