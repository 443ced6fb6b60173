"""Find the honest model of a solver by assuming choices in turn along the probes.

Each probe adds an aspect to the probes before it. A hypothesis makes a choice for each aspect that
has mattered so far.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..exchange import Answer, Exchange
from ..greeting import Greeting
from .honest import ASPECTS, Option, compatible, declared, declared_choices, honest, model_of
from .laws import SOLVED, Rounding, relative_gap, rounding
from .model import Integrator, StepModel, predicted
from .pin_strength import measured_pins
from .problem import SpringProblem

# The number of hypotheses that are kept from one probe to the next.
HYPOTHESES = 32
# A relative difference below this is not from single precision.
DOUBLE = 1e-11
# Positions beyond this [m] come from dividing by zero; those of the probes are some metres.
LARGEST = 1e4
# Aspects that matter in any step; the others where there are dampers or pins.
ALWAYS = ("integrator", "substeps", "velocity", "scaling")
# A step that arrives at once where no spring acts.
ONE_STEP = Integrator("newton", "x_n", 1, "gauss")
# An option for each aspect. Where no spring has acted yet, "flight" stands for "integrator": the
# first of those that move free particles alike.
Choices = dict[str, Option]


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
        more = {"damper": self.problem.damped, "pins": self.problem.pinned.size}
        return [*ALWAYS, *(aspect for aspect, matters in more.items() if matters)]

    def stages(self) -> list["Probe"]:
        """Return the probe with the positions alone, on which fewer aspects act, then with all."""
        if self.problem.steps or len(self.answers) < 2 or "positions" not in self.answers:
            return [self]
        return [self._replace(answers={"positions": self.answers["positions"]}), self]


class ModelSearch:
    """The search of the choices that explain a solver's answers to the probes."""

    def __init__(self, probes: Sequence[Probe], greeting: Greeting) -> None:
        """Set up the choices that the greeting declares or leaves open."""
        step = greeting.step
        self._step, self._epsilon = step, greeting.epsilon
        self._stages = [stage for probe in probes for stage in probe.stages()]
        self._domains = declared_choices(step)
        firsts = [(p.problem.changed(steps=None), _first_frame(p)) for p in probes]
        pins = measured_pins(self._domains["pins"], firsts)
        self._domains["pins"] = [option for option in pins if declared(option, step)]
        # the integrators that each one of the domain "flight" stands for
        self._classes: dict[Integrator, list[Option]] = {}
        for option in self._domains["integrator"]:
            self._classes.setdefault(in_flight(option.fields["integrator"]), []).append(option)
        self._domains["flight"] = [
            members[0]._replace(fields={"integrator": flight})
            for flight, members in self._classes.items()
        ]
        self._roundings: dict[tuple[Any, ...], Rounding] = {}
        self._gaps: dict[tuple[Any, ...], float | None] = {}

    def run(self, cases: Sequence[Probe] = ()) -> tuple[Option, ...]:
        """Return the choices that explain all probes, () if no choices do.

        Small probes do not tell where many iterations begin: of several honest steps the step that
        explains all `cases` is taken.
        """
        hypotheses = [Choices()]
        for index in range(len(self._stages)):
            hypotheses = self._explaining(hypotheses, index)
        matches = [self._match(choices) for choices in hypotheses if self._explains_enough(choices)]
        matches.sort(key=lambda match: not self._explains_all(match, cases))
        return matches[0] if matches else ()

    def _explaining(self, hypotheses: Sequence[Choices], index: int) -> list[Choices]:
        """Return the hypotheses, extended by a stage, that explain it, nearest first."""
        branches = [branch for h in hypotheses for branch in self._branches(h, index)]
        explaining = [branch for branch in branches if self._explains(branch, index)]
        unique = {frozenset(map(id, choices.values())): choices for choices in explaining}
        ranked = sorted(unique.values(), key=lambda choices: self._rank(choices, index))
        if not self._is_complete(index):
            return ranked
        gaps = [self._gap(choices, index) for choices in ranked]
        pairs = list(zip(ranked, gaps, strict=True))
        reproducing = _varied([choices for choices, gap in pairs if gap is not None])
        unpredicted = [choices for choices, gap in pairs if gap is None]
        return reproducing[:HYPOTHESES] + unpredicted[:HYPOTHESES]

    def _explains_all(self, match: Sequence[Option], cases: Sequence[Probe]) -> bool:
        """Return whether a match explains every case."""
        return all(gaps_of(match, [case], self._epsilon)[0] <= SOLVED for case in cases)

    def is_double(self) -> bool:
        """Return whether answers in flight have more digits than single precision leaves."""
        gaps = [gap for key, gap in self._gaps.items() if key[0] == 0 and gap is not None]
        return min(gaps, default=1.0) < DOUBLE

    def _is_complete(self, index: int) -> bool:
        """Return whether a stage has all outputs of its probe."""
        stages = self._stages
        return index + 1 == len(stages) or stages[index + 1].name != stages[index].name

    def _rank(self, choices: Choices, index: int) -> float:
        """Return the power of ten of the gap, which rounding leaves."""
        gap = self._gap(choices, index) or 0.0
        return float(np.round(np.log10(gap + 1e-12)))

    def _branches(self, choices: Choices, index: int) -> Iterator[Choices]:
        """Yield a hypothesis with each honest choice of the aspects that matter first here."""
        stage, chosen = self._stages[index], {**choices}
        flight = chosen.pop("flight", None) if stage.coupled else None
        aspects = stage.aspects()
        if not stage.coupled and "integrator" not in choices:
            aspects[aspects.index("integrator")] = "flight"
        aspects = [aspect for aspect in aspects if aspect not in chosen]
        domains = [self._domains[aspect] for aspect in aspects]
        if flight is not None:
            of_flight = self._classes[flight.fields["integrator"]]
            domains[aspects.index("integrator")] = of_flight
        for options in product(*domains):
            branch = chosen | dict(zip(aspects, options, strict=True))
            if compatible(branch) and not self._holds_nothing(branch):
                yield branch

    def _holds_nothing(self, choices: Choices) -> bool:
        """Return whether springs to pins, undeclared, do not act in the only explicit step."""
        model = model_of(list(choices.values()))
        is_single = model.integrator.explicit and model.substeps == 1
        return self._step.pins is None and is_single and model.pin_kind in ("penalty", "springs")

    def _explains_enough(self, choices: Choices) -> bool:
        """Return whether no more than a few answers are left out because of singular matrices."""
        explained = [self._gap(choices, i) is not None for i in range(len(self._stages))]
        return any(explained) and 2 * explained.count(True) >= min(8, len(explained))

    def _explains(self, choices: Choices, index: int) -> bool:
        """Return whether choices reproduce an answer, or neither is a number of use."""
        gap = self._gap(choices, index)
        return gap is None or gap <= SOLVED

    def _gap(self, choices: Choices, index: int) -> float | None:
        """Return how far a prediction is from an answer, None where neither is a number of use."""
        stage = self._stages[index]
        ignored: tuple[str, ...] = ()
        if len(stage.answers) == 1 and choices["substeps"].fields["substeps"] == 1:
            ignored = ("velocity", "scaling")  # neither enters the positions
        key = index, frozenset(id(o) for k, o in choices.items() if k not in ignored)
        if key not in self._gaps:
            self._gaps[key] = self._compare(model_of(list(choices.values())), stage)
        return self._gaps[key]

    def _compare(self, model: StepModel, probe: Probe) -> float | None:
        """Return how far the step of a model is from an answer."""
        prediction = predicted(probe.problem, model, probe.answers.get("positions"))
        if is_singular(prediction):
            return None if is_singular(probe.answers) else np.inf
        key = probe.name, model.substeps, model.integrator.explicit
        if key not in self._roundings:
            self._roundings[key] = rounding(probe.problem, model, self._epsilon)
        return relative_gap(probe.problem, prediction, probe.answers, self._roundings[key])

    def _match(self, choices: Choices) -> tuple[Option, ...]:
        """Return one choice for each aspect that matters, in the order of the computation."""
        if "flight" in choices:
            members = self._classes[choices["flight"].fields["integrator"]]
            choices = {**choices, "integrator": members[0]}
        return tuple(choices[aspect] for aspect in ASPECTS if aspect in choices)


def _varied(hypotheses: Sequence[Choices]) -> list[Choices]:
    """Return hypotheses in turn with each integrator, the nearest of each first.

    Several integrators agree in small probes, in single precision in most.
    """
    counts, order = dict[int, int](), list[int]()
    for choices in hypotheses:
        kind = id(choices.get("integrator"))
        counts[kind] = counts.get(kind, 0) + 1
        order.append(counts[kind])
    return [hypotheses[i] for i in sorted(range(len(order)), key=order.__getitem__)]


def _first_frame(probe: Probe) -> Mapping[str, Any]:
    """Return the answers to a step, or those of the first of several."""
    if not probe.problem.steps:
        return probe.answers
    return {name: frames[0] for name, frames in probe.answers.items()}


def in_flight(integrator: Integrator) -> Integrator:
    """Return an integrator that moves free particles alike: without springs g is quadratic.

    A single step of Newton's method stands for all that solve for the minimum.
    """
    return integrator if integrator.explicit else ONE_STEP


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
    gaps, model = [], model_of(options)
    for problem, answers, _ in probes:
        expected, allowed = predicted(problem, model), rounding(problem, model, epsilon)
        gaps.append(relative_gap(problem, expected, answers, allowed) if expected else np.inf)
    return gaps


def honest_options(match: Sequence[Option], greeting: Greeting) -> tuple[Option, ...]:
    """Return the recognised choices of a solver, completed by declared and usual choices."""
    recognised = {option.aspect: option for option in match}
    choices = declared_choices(greeting.step)
    usual = {a: (choices[a] or honest(greeting.step)[a])[0] for a in ASPECTS} | recognised
    if usual["integrator"].fields["integrator"].explicit:
        for aspect, name in (("damper", "explicit"), ("velocity", "separate")):
            if aspect not in recognised:
                fits = (option for option in choices[aspect] if option.fields[aspect] == name)
                usual[aspect] = next(fits, usual[aspect])
    return tuple(usual[aspect] for aspect in ASPECTS)
