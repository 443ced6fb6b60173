"""Find the honest model of a solver by assuming choices in turn along the probes.

Each probe adds an aspect to the probes before it. A hypothesis makes a choice for each aspect that
has mattered so far.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..contestant import Answer, Exchange
from ..greeting import Greeting
from .honest import compatible, declared, honest_domains
from .laws import SOLVED, Rounding, relative_gap, rounding
from .model import RIGHT_MATRIX, Integrator, StepModel, predicted
from .options import ASPECTS, MAX_FAULTS, Option, apply
from .pin_strength import measured_pins
from .problem import SpringProblem

# The number of hypotheses that are kept from one probe to the next.
HYPOTHESES = 32
# The share of the evidence that may stay unexplained beside a fault.
UNEXPLAINED = 0.25
# The iterations that a converged substep takes, about, unless the answer tells its solution.
ITERATIONS_TO_CONVERGE = 10
# A relative difference below this is not from single precision.
DOUBLE = 1e-11
# Positions beyond this [m] come from dividing by zero; those of the probes are some metres.
LARGEST = 1e4
# Aspects that matter in any step; the others where there are dampers or pins.
ALWAYS = (
    "time", "reading", "inertia", "masses", "gravity", "integrator", "matrix", "substeps",
    "velocity", "update", "scaling", "springs", "answers",
)  # fmt: skip
# A step that arrives at once where no spring acts.
ONE_STEP = Integrator("newton", "x_n", 1, "gauss")
# An option for each aspect. Where no spring has acted yet, "flight" stands for "integrator": the
# first of those that move free particles alike.
Choices = dict[str, Option]


class ModelMatch(NamedTuple):
    """Choices that reproduce the answers to the probes."""

    # one for each aspect that matters in a probe, in the order of the computation
    options: tuple[Option, ...]
    faults: tuple[Option, ...]  # those of them that the greeting denies, or that nobody should make

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of the faults."""
        return tuple(fault.key for fault in self.faults)

    @property
    def complexity(self) -> tuple[int, int]:
        """The number of faults, and of faults in a part of the step alone."""
        return len(self.faults), sum(bool(fault.part) for fault in self.faults)


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
        more = {"damper": p.damped, "damping": p.damped, "pins": p.pinned.size, "frames": p.steps}
        return [*ALWAYS, *(aspect for aspect, matters in more.items() if matters)]

    def first_step(self) -> "Probe":
        """Return the first step of a motion as a step."""
        first = {name: frames[0] for name, frames in self.answers.items()}
        return self._replace(problem=self.problem.changed(steps=None), answers=first)

    def positions(self) -> "Probe":
        """Return the probe without velocities."""
        return self._replace(answers={"positions": self.answers["positions"]})

    def stages(self) -> list["Probe"]:
        """Return the probe with the positions alone, on which fewer aspects act, then with all."""
        if self.problem.steps or len(self.answers) < 2 or "positions" not in self.answers:
            return [self]
        return [self.positions(), self]


class ModelSearch:
    """The search of the choices that explain a solver's answers to the probes."""

    def __init__(
        self,
        probes: Sequence[Probe],
        greeting: Greeting,
        aspects: Collection[str] | None = (),
        faults: Mapping[str, Sequence[Option]] = MappingProxyType({}),
    ) -> None:
        """Set up the domains of all choices.

        In some aspects, or in all if they are None, they may be choices that the greeting denies,
        or faults.
        """
        step = greeting.step
        self.probes, self.greeting, self.step, self.epsilon = (
            probes, greeting, step, greeting.epsilon,
        )  # fmt: skip
        self.stages = [stage for probe in probes for stage in probe.stages()]
        self.domains = {
            aspect: [pair for pair in domain if not pair[1] or aspects is None or aspect in aspects]
            for aspect, domain in honest_domains(step).items()
        }
        firsts = [probe.first_step() if probe.problem.steps else probe for probe in probes]
        answers = [(probe.problem, probe.answers) for probe in firsts]
        pins = measured_pins([option for option, _ in self.domains["pins"]], answers)
        self.domains["pins"] = [(option, int(not declared(option, step))) for option in pins]
        for aspect, domain in self.domains.items():
            domain += [(fault, 1) for fault in faults.get(aspect, ())]
            domain.sort(key=lambda pair: pair[1])
        # where masses are wrong, local/global iterations differ from Newton's even in flight
        self.flight = Integrator("local_global") if step.method == "local_global" else ONE_STEP
        # the integrators that each one of the domain "flight" stands for
        self.classes: dict[Integrator, list[tuple[Option, int]]] = {}
        for option, cost in self.domains["integrator"]:
            flight = in_flight(option.fields["integrator"], self.flight)
            self.classes.setdefault(flight, []).append((option, cost))
        self.domains["flight"] = [
            (pairs[0][0]._replace(fields={"integrator": flight}), min(cost for _, cost in pairs))
            for flight, pairs in self.classes.items()
        ]
        # it flies as implicit Euler does, so that no flight tells that it is not what is declared
        self.symplectic = [
            (option, cost)
            for option, cost in self.domains["integrator"]
            if cost and option.fields["integrator"].method == "symplectic"
        ]
        self.costs = {id(option): cost for pairs in self.domains.values() for option, cost in pairs}
        self.declared_aspects = [
            *(["damper", "scaling"] if step.damper is not None else []),
            *(["substeps"] if step.substeps is not None else []),
            *(["integrator"] if step.order is not None else []),
        ]
        self.prediction_count = 0  # number of predictions
        self._work = 0.0  # iterations and substeps that they took
        self._skipped: set[int] = set()  # stages that no hypothesis explains
        self._roundings: dict[tuple[Any, ...], Rounding] = {}
        self._gaps: dict[tuple[Any, ...], float | None] = {}

    def run(self, cases: Sequence[Probe] = ()) -> list[ModelMatch]:
        """Return the matches of the probes with the fewest faults, none if there are none.

        Small probes do not tell where many iterations begin: of several honest steps the step that
        explains all `cases` is taken.
        """
        hypotheses = [Choices()]
        for index in range(len(self.stages)):
            is_hopeless = index - 1 in self._skipped and self._is_complete(index)
            explaining = [] if is_hopeless else self._explaining(hypotheses, index)
            if not explaining:
                self._skipped.add(index)
            if len(self._skipped) > UNEXPLAINED * (index + 1):
                return []
            hypotheses = explaining or hypotheses
        matches = [self._match(self._needed(h)) for h in hypotheses if self._explains_enough(h)]
        if self._skipped:
            matches = [match for match in matches if match.faults]
        matches.sort(key=lambda match: bool(match.faults) or not self._explains_all(match, cases))
        fewest = min((match.complexity for match in matches), default=None)
        first = {match.keys: match for match in reversed(matches) if match.complexity == fewest}
        return list(reversed(first.values()))

    def _explaining(self, hypotheses: Sequence[Choices], index: int) -> list[Choices]:
        """Return the hypotheses, extended by a stage, that explain it, simplest first."""
        branches = [branch for h in hypotheses for branch in self._branches(h, index)]
        explaining = [branch for branch in branches if self._explains(branch, index)]
        explaining += self._with_faults(branches, explaining, index)
        unique = {frozenset(map(id, choices.values())): choices for choices in explaining}
        ranked = sorted(unique.values(), key=lambda choices: self._rank(choices, index))
        if not self._is_complete(index):
            return ranked
        reproducing = self._varied(self._reproducing(ranked, index))
        unpredicted = [choices for choices in ranked if self._gap(choices, index) is None]
        return reproducing[:HYPOTHESES] + unpredicted[:HYPOTHESES]

    def _with_faults(
        self, branches: Sequence[Choices], explaining: Sequence[Choices], index: int
    ) -> list[Choices]:
        """Return hypotheses with a fault, none in a search of honest programs."""
        return []

    def _varied(self, hypotheses: Sequence[Choices]) -> list[Choices]:
        """Return hypotheses, simplest first, in turn with each set of faults or each integrator."""
        counts, order = dict[frozenset[int], int](), list[tuple[int, int]]()
        for choices in hypotheses:
            faults = frozenset(id(o) for o in choices.values() if self.costs[id(o)])
            # several integrators agree in small probes, in single precision in most
            kind = faults or frozenset(map(id, filter(None, [choices.get("integrator")])))
            counts[kind] = counts.get(kind, 0) + 1
            order.append((len(faults), counts[kind]))
        return [hypotheses[i] for i in sorted(range(len(order)), key=order.__getitem__)]

    def _explains_all(self, match: ModelMatch, cases: Sequence[Probe]) -> bool:
        """Return whether a match explains every case."""
        gaps = (gaps_of(match.options, [case], self.epsilon)[0] for case in cases)
        return all(gap <= SOLVED for gap in gaps)

    def is_double(self) -> bool:
        """Return whether answers in flight have more digits than single precision leaves."""
        gaps = [gap for key, gap in self._gaps.items() if key[0] == 0 and gap is not None]
        return min(gaps, default=1.0) < DOUBLE

    def _reproducing(self, hypotheses: Sequence[Choices], index: int) -> list[Choices]:
        """Return the explaining hypotheses that predict a number."""
        return [choices for choices in hypotheses if self._gap(choices, index) is not None]

    def _is_complete(self, index: int) -> bool:
        """Return whether a stage has all outputs of its probe."""
        return (
            index + 1 == len(self.stages) or self.stages[index + 1].name != self.stages[index].name
        )

    def _rank(self, choices: Choices, index: int) -> tuple[int, float]:
        """Return the number of faults and the power of ten of the gap, which rounding leaves."""
        gap = self._gap(choices, index) or 0.0
        return self._cost(choices), float(np.round(np.log10(gap + 1e-12)))

    def _branches(self, choices: Choices, index: int) -> Iterator[Choices]:
        """Yield a hypothesis with each honest choice of the aspects that matter first here."""
        stage, chosen = self.stages[index], {**choices}
        flight = chosen.pop("flight", None) if stage.coupled else None
        aspects = stage.aspects()
        if not stage.coupled and "integrator" not in choices:
            aspects[aspects.index("integrator")] = "flight"
        aspects = [aspect for aspect in aspects if aspect not in chosen]
        domains = []
        for aspect in aspects:
            domain, most = self.domains[aspect], 0
            if aspect == "integrator" and flight is not None:
                domain = self.classes[flight.fields["integrator"]]
                most = self.costs[id(flight)]
            domains.append([option for option, cost in domain if cost <= most])
        for options in product(*domains):
            branch = chosen | dict(zip(aspects, options, strict=True))
            is_untried = self._cost(branch) and self._is_rare(branch)
            if compatible(branch) and not is_untried and not self._holds_nothing(branch):
                yield branch

    def _holds_nothing(self, choices: Choices) -> bool:
        """Return whether springs to pins, undeclared, do not act in the only explicit step."""
        model = StepModel()._replace(**fields_of(choices))
        is_single = model.integrator.explicit and model.substeps == 1
        return self.step.pins is None and is_single and model.pin_kind in ("penalty", "springs")

    def _cost(self, choices: Choices) -> int:
        return sum(self.costs[id(option)] for option in choices.values())

    def _is_rare(self, choices: Choices) -> bool:
        """Return whether choices are never tried together with faults."""
        return any(
            option.rare and option.aspect not in self.declared_aspects
            for option in choices.values()
            if not self.costs[id(option)]
        )

    def _fits(self, choices: Choices, index: int) -> bool:
        """Return whether choices explain the stages up to an index, but for inexplicable stages."""
        return (
            self._cost(choices) <= MAX_FAULTS
            and compatible(choices)
            and all(
                self._explains(choices, i) for i in range(index, -1, -1) if i not in self._skipped
            )
        )

    def _needed(self, choices: Choices) -> Choices:
        """Return the choices without faults that explain no more than the others do."""
        for aspect, option in choices.items():
            honest_option, cost = self.domains[aspect][0]
            simpler = choices | {aspect: honest_option}
            if self.costs[id(option)] and not cost and self._fits(simpler, len(self.stages) - 1):
                return self._needed(simpler)
        return choices

    def _explains_enough(self, choices: Choices) -> bool:
        """Return whether no more than a few answers are left out because of singular matrices."""
        explained = [self._gap(choices, i) is not None for i in range(len(self.stages))]
        return any(explained) and 2 * explained.count(True) >= min(8, len(explained))

    def _explains(self, choices: Choices, index: int) -> bool:
        """Return whether choices reproduce an answer, or neither is a number of use."""
        gap = self._gap(choices, index)
        return gap is None or gap <= SOLVED

    def _gap(self, choices: Choices, index: int) -> float | None:
        """Return how far a prediction is from an answer, None where neither is a number of use."""
        stage = self.stages[index]
        relevant = choices if stage.coupled else _relevant_in_flight(choices)
        if not stage.coupled and choices["matrix"].key.startswith("matrix without k"):
            return None  # it joins particles by springs without stiffness, each integrator its way
        ignored: tuple[str, ...] = ()
        if len(stage.answers) == 1 and relevant["substeps"].fields["substeps"] == 1:
            ignored = ("velocity", "scaling")  # neither enters the positions
        key = index, frozenset(id(o) for k, o in relevant.items() if k not in ignored)
        if key not in self._gaps:
            self.prediction_count += 1
            self._spend(effort_of(relevant) if stage.coupled else 1.0)
            self._gaps[key] = self._compare(tuple(relevant.values()), stage)
        return self._gaps[key]

    def _spend(self, effort: float) -> None:
        self._work += effort

    def _rounding(self, probe: Probe, model: StepModel) -> Rounding:
        key = probe.name, model.substeps, model.integrator.explicit
        if key not in self._roundings:
            self._roundings[key] = rounding(probe.problem, model, self.epsilon)
        return self._roundings[key]

    def _compare(self, options: tuple[Option, ...], probe: Probe) -> float | None:
        """Return how far the step with these options is from an answer."""
        problem, model = apply(options, probe.problem, StepModel(damper="none"))
        plain = probe.problem
        if problem.stiff > plain.stiff or problem.damped > plain.damped:
            return None  # aspects matter of which nothing is assumed yet
        prediction = predicted(problem, model, probe.answers.get("positions"))
        if is_singular(prediction):
            return None if is_singular(probe.answers) else np.inf
        allowed = self._rounding(probe, model)
        return relative_gap(probe.problem, prediction, probe.answers, allowed)

    def _match(self, choices: Choices) -> ModelMatch:
        if "flight" in choices:
            members = self.classes[choices["flight"].fields["integrator"]]
            choices = {**choices, "integrator": members[0][0]}
        options = tuple(choices[aspect] for aspect in ASPECTS if aspect in choices)
        return ModelMatch(options, tuple(o for o in options if self.costs[id(o)]))


def effort_of(choices: Choices) -> float:
    """Return how many iterations, or a few substeps of explicit methods, a prediction takes."""
    fields = fields_of(choices)
    integrator, substeps = fields["integrator"], fields["substeps"]
    iterations = 0.3 if integrator.explicit else integrator.iterations
    if integrator.method == "converged" and substeps > 1:
        iterations = ITERATIONS_TO_CONVERGE
    return float(1.0 + substeps * iterations)


def fields_of(choices: Choices) -> dict[str, Any]:
    """Return the fields of a model that choices replace."""
    return {k: value for option in choices.values() for k, value in option.fields.items()}


def _relevant_in_flight(choices: Choices) -> Choices:
    """Return the choices that matter where no spring acts."""
    return {
        aspect: option
        for aspect, option in choices.items()
        if (aspect != "matrix" or _acts_in_flight(option))
        and (aspect != "time" or option.fields.get("time") != "before")
    }


def _acts_in_flight(option: Option) -> bool:
    """Return whether a matrix matters where no spring acts."""
    matrix = option.fields.get("matrix", RIGHT_MATRIX)
    is_other = matrix.masses != 1.0 or matrix.right_power or matrix.is_by_columns
    is_other |= matrix.filled.startswith("A[")
    return bool(is_other or matrix.inverse.startswith("factors"))


def in_flight(integrator: Integrator, usual: Integrator = ONE_STEP) -> Integrator:
    """Return an integrator that moves free particles alike: without springs g is quadratic.

    The usual integrator that solves for the minimum stands for all of its kind.
    """
    if integrator.method == "in_place":
        return integrator._replace(method="symplectic")
    if integrator.explicit or integrator.method == "descent":
        return integrator
    if integrator.method == "newton" and integrator.rate != 1.0:
        return integrator._replace(hessian="gauss")
    return usual


def probes_of(
    exchanges: Sequence[Exchange], problems: Mapping[str, SpringProblem], every: bool = False
) -> list[Probe]:
    """Return the probes, or every case, that were answers, in their order."""
    return [
        Probe(problems[exchange.case.name], exchange.answer.values, exchange.case.name)
        for exchange in exchanges
        if isinstance(exchange.answer, Answer) and (every or exchange.case.facts.get("probe"))
    ]


def is_singular(values: Mapping[str, Any]) -> bool:
    """Return whether positions are missing or huge, as from a singular matrix."""
    return "positions" not in values or not np.abs(values["positions"]).max() < LARGEST


def gaps_of(options: Sequence[Option], probes: Sequence[Probe], epsilon: float) -> list[float]:
    """Return how far answers are from a step with these options, relative to displacements."""
    gaps = []
    for plain, answers, _ in probes:
        p, model = apply(options, plain, StepModel(damper="none"))
        expected, allowed = predicted(p, model), rounding(plain, model, epsilon)
        gaps.append(relative_gap(plain, expected, answers, allowed) if expected else np.inf)
    return gaps
