"""Find the model of a solver by assuming choices in turn along the probes.

Each probe adds an aspect to the probes before it. Choices are therefore refuted where
they first matter, so that combinations of three among some hundred faults and as many honest models
are found without trying the millions that there are.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..contestant import Answer, Exchange
from ..greeting import Step
from .faults import ASPECTS, MAX_FAULTS, STEP_FAULTS, Option, apply
from .honest import compatible, domains
from .laws import SOLVED, Rounding, relative_gap, rounding
from .model import Integrator, StepModel, predicted
from .problem import SpringProblem

# The number of combinations that are tried, in a fixed order, with no fault, one, two and three: a
# few seconds each, for a solver that none explains. On all machines the same faults are named.
COMBINATIONS = (5_000, 12_000, 12_000, 20_000)
# Integrators with more iterations are not combined with faults.
MAX_ITERATIONS = 10
# Matrices that are singular without pins, where they predict nothing.
SINGULAR = ("matrix L", "matrix L without h²")
# Matrices that matter where no spring acts.
OF_MASSES = (*SINGULAR, "matrix 2M+h²L")
# Positions beyond this [m] come from dividing by zero; those of the probes are some metres.
LARGEST = 1e4
# Aspects that matter in any step; the others where there are springs, dampers, pins.
ALWAYS = (
    "time", "inertia", "masses", "gravity", "integrator", "matrix", "substeps", "velocity",
    "scaling",
)  # fmt: skip
FAULTY = frozenset(map(id, STEP_FAULTS))

# An option for each aspect. Where no spring has acted yet, "flight" stands for "integrator": the
# first of those that move free particles alike.
Choices = dict[str, Option]


class ModelMatch(NamedTuple):
    """Choices that reproduce the answers to all probes."""

    # one for each aspect that matters in a probe, in the order of the computation
    options: tuple[Option, ...]
    faults: tuple[Option, ...]  # those of them that the greeting denies, or that nobody should make

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of the faults."""
        return tuple(fault.key for fault in self.faults)


class Probe(NamedTuple):
    """A problem, and the answer to it."""

    problem: SpringProblem
    answers: Mapping[str, Any]
    name: str

    @property
    def coupled(self) -> bool:
        """Whether springs or dampers act."""
        return self.problem.stiff or self.problem.damped

    def aspects(self) -> list[str]:
        """Return the aspects that matter, in the order in which they are chosen."""
        p = self.problem
        more = {"springs": p.stiff, "damper": p.damped, "damping": p.damped, "pins": p.pinned.size}
        return [*ALWAYS, *(aspect for aspect, matters in more.items() if matters)]


class ModelSearch:
    """The search of the choices that explain a solver's answers to the probes."""

    def __init__(self, probes: Sequence[Probe], step: Step, epsilon: float) -> None:
        """Set up the domains of all choices."""
        self.probes, self.step, self.epsilon = probes, step, epsilon
        self.domains = domains(step)
        # the integrators that each one of the domain "flight" stands for
        self.classes: dict[Integrator, list[tuple[Option, int]]] = {}
        for option, cost in self.domains["integrator"]:
            flight = in_flight(option.fields["integrator"])
            self.classes.setdefault(flight, []).append((option, cost))
        self.domains["flight"] = [
            (pairs[0][0]._replace(fields={"integrator": flight}), min(cost for _, cost in pairs))
            for flight, pairs in self.classes.items()
        ]
        self.costs = {id(option): cost for pairs in self.domains.values() for option, cost in pairs}
        self.declared_aspects = [
            *(["damper", "scaling"] if step.damper is not None else []),
            *(["substeps"] if step.substeps is not None else []),
        ]
        self.prediction_count = 0  # number of predictions
        self._misplaced: set[tuple[Any, ...]] = set()  # choices whose positions are wrong
        self._roundings: dict[tuple[Any, ...], Rounding] = {}
        self._explained: dict[tuple[Any, ...], bool | None] = {}
        self._matched_keys: set[tuple[str, ...]] = set()  # faults that explain all probes
        self._remaining = 0  # number of combinations that may still be tried

    def run(self) -> list[ModelMatch]:
        """Return the matches of all probes with the fewest faults, none if there are none."""
        for budget in range(MAX_FAULTS + 1) if self.probes else ():
            self._remaining = COMBINATIONS[budget]
            matches = [m for m in self._explanations({}, 0, budget) if len(m.faults) == budget]
            if matches:
                return matches
        return []

    def _explanations(self, choices: Choices, index: int, budget: int) -> Iterator[ModelMatch]:
        """Yield the matches of the probes from an index on, given the choices made before."""
        if index == len(self.probes):
            if self._explains_enough(choices):
                match = self._match(choices)
                self._matched_keys.add(match.keys)
                yield match
            return
        probe = self.probes[index]
        aspects = probe.aspects()
        if not probe.coupled and "integrator" not in choices:
            aspects[aspects.index("integrator")] = "flight"
        aspects = [aspect for aspect in aspects if aspect not in choices]
        for extended in self._extensions(choices, aspects, budget):
            if not self._remaining:
                return
            self._remaining -= 1
            if not self._is_named(extended) and self._explains(extended, index) is not False:
                yield from self._explanations(extended, index + 1, budget)

    def _is_named(self, choices: Choices) -> bool:
        """Return whether the same faults explain all probes with other honest choices."""
        if not self._matched_keys or "flight" in choices:
            return False
        return self._match(choices).keys in self._matched_keys

    def _extensions(
        self, choices: Choices, aspects: Sequence[str], budget: int
    ) -> Iterator[Choices]:
        """Yield the choices extended by options of more aspects, within a number of faults."""
        remaining = budget - sum(self.costs[id(option)] for option in choices.values())
        if remaining < 0 or not compatible(choices):
            return
        if not aspects:
            yield choices
            return
        aspect, *later = aspects
        domain = self.domains[aspect]
        if aspect == "integrator" and "flight" in choices:
            flight = choices["flight"]
            domain, remaining = self.classes[flight.fields["integrator"]], budget
            choices = {name: option for name, option in choices.items() if name != "flight"}
        for option, cost in domain:
            if cost <= remaining and not self._is_left_out(option, budget):
                yield from self._extensions(choices | {aspect: option}, later, budget)

    def _is_left_out(self, option: Option, budget: int) -> bool:
        """Return whether a choice is not tried together with so many faults."""
        return (
            (budget > 0 and option.rare and option.aspect not in self.declared_aspects)
            or (budget > 1 and self.costs[id(option)] > 0 and _takes_long(option))
            or (budget > 2 and option.key in SINGULAR)
        )

    def _explains_enough(self, choices: Choices) -> bool:
        """Return whether no more than a few answers are left out because of singular matrices."""
        explained = [self._explains(choices, i) for i in range(len(self.probes))]
        return 2 * explained.count(True) >= min(4, len(explained))

    def _explains(self, choices: Choices, index: int) -> bool | None:
        """Return whether choices reproduce an answer; None where neither is a number of use."""
        probe = self.probes[index]
        relevant = choices if probe.coupled else _relevant_in_flight(choices)
        if not probe.coupled and choices["matrix"].key.startswith("matrix without k"):
            return None  # it joins particles by springs without stiffness, each integrator its way
        parts = sorted((name, id(option)) for name, option in relevant.items())
        key = position_key = (index, *parts)
        if relevant["substeps"].fields["substeps"] == 1:  # velocities do not enter positions
            position_key = (index, *(part for part in parts if part[0] != "velocity"))
        if position_key in self._misplaced:
            return False
        if key not in self._explained:
            self.prediction_count += 1
            self._explained[key], is_placed = self._compare(tuple(relevant.values()), probe)
            if not is_placed:
                self._misplaced.add(position_key)
        return self._explained[key]

    def _rounding(self, probe: Probe, model: StepModel) -> Rounding:
        key = probe.name, model.substeps, model.integrator.explicit
        if key not in self._roundings:
            self._roundings[key] = rounding(probe.problem, model, self.epsilon)
        return self._roundings[key]

    def _compare(self, options: tuple[Option, ...], probe: Probe) -> tuple[bool | None, bool]:
        """Return whether an answer is reproduced, and whether its positions may be."""
        problem, model = apply(options, probe.problem, StepModel(damper="none"))
        prediction, answers = predicted(problem, model), probe.answers
        if _is_singular(prediction):
            return (None if _is_singular(answers) else False), True
        allowed = self._rounding(probe, model)
        if relative_gap(probe.problem, prediction, answers, allowed) <= SOLVED:
            return True, True
        if problem.steps or "positions" not in answers:
            return False, True
        positions = {"positions": answers["positions"]}
        return False, relative_gap(probe.problem, prediction, positions, allowed) <= SOLVED

    def _match(self, choices: Choices) -> ModelMatch:
        if "flight" in choices:
            members = self.classes[choices["flight"].fields["integrator"]]
            choices = {**choices, "integrator": members[0][0]}
        options = tuple(choices[aspect] for aspect in ASPECTS if aspect in choices)
        return ModelMatch(options, tuple(o for o in options if self.costs[id(o)]))


def _is_singular(values: Mapping[str, Any]) -> bool:
    """Return whether positions are missing or huge, as from a singular matrix."""
    return "positions" not in values or not np.abs(values["positions"]).max() < LARGEST


def _takes_long(option: Option) -> bool:
    """Return whether a choice is not tried together with other faults.

    These are integrators that take long, and honest integrators and numbers of substeps that the
    greeting denies.
    """
    integrator = option.fields.get("integrator")
    if integrator is None:
        return option.aspect in ("substeps", "scaling")
    is_long = integrator.method == "descent" or integrator.iterations > MAX_ITERATIONS
    return is_long or id(option) not in FAULTY


def _relevant_in_flight(choices: Choices) -> Choices:
    """Return the choices that matter where no spring acts."""
    return {
        aspect: option
        for aspect, option in choices.items()
        if (aspect != "matrix" or option.key in OF_MASSES)
        and (aspect != "time" or option.fields.get("time") != "before")
    }


def in_flight(integrator: Integrator) -> Integrator:
    """Return an integrator that moves free particles alike: without springs g is quadratic."""
    if integrator.explicit or integrator.method == "descent":
        return integrator
    if integrator.method == "newton" and integrator.rate != 1.0:
        return integrator._replace(hessian="gauss")
    return Integrator("newton", "x_n", 1, "gauss")


def probes_of(
    exchanges: Sequence[Exchange], problems: Mapping[str, SpringProblem], every: bool = False
) -> list[Probe]:
    """Return the probes, or every case, that were answers, in their order."""
    return [
        Probe(problems[exchange.case.name], exchange.answer.values, exchange.case.name)
        for exchange in exchanges
        if isinstance(exchange.answer, Answer) and (every or exchange.case.facts.get("probe"))
    ]
