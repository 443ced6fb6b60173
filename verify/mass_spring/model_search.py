"""Find the honest model of a solver by assuming choices in turn along the probes.

Each probe adds an aspect to the probes before it. A hypothesis makes a choice for each aspect that
has mattered so far; it is followed to the last probe before the next one is tried.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product
from typing import Any, NamedTuple

import numpy as np

from ..exchange import Answer, Exchange
from ..greeting import Greeting, Step
from .honest import ASPECTS, Option, compatible, declared_choices, honest, model_of
from .laws import SOLVED, relative_gap, rounding
from .measured import measured
from .model import Integrator, Scaling, StepModel, predicted
from .problem import SpringProblem

# So many hypotheses that explain all probes are compared with all cases.
MAX_MATCHES = 64
# A relative difference below this is not from single precision.
DOUBLE = 1e-11
# Positions beyond this [m] come from dividing by zero; those of the probes are some metres.
LARGEST = 1e4
# Aspects that matter in any step; the others where there are dampers or pins.
ALWAYS = ("integrator", "substeps", "velocity", "scaling")
# It stands for all that solve for the minimum where no spring acts and g is quadratic.
ONE_STEP = Integrator("newton", "x_n", 1, "gauss")
# An option for each aspect.
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
        """Return the relevant aspects, in the order of choice."""
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
        self._epsilon = greeting.epsilon
        self._stages = [stage for probe in probes for stage in probe.stages()]
        firsts = [(p.problem.changed(steps=None), _first_frame(p)) for p in probes]
        numbers = measured(firsts, greeting.step.substeps)
        self._domains = declared_choices(greeting.step, numbers)
        self._gaps: dict[tuple[str, int, StepModel], float | None] = {}

    def run(self, cases: Sequence[Probe] = ()) -> tuple[Option, ...]:
        """Return the choices that explain all probes, () if no choices do.

        Small probes do not tell where many iterations begin: of several honest steps the step that
        explains all `cases` is taken, of which the last are the hardest.
        """
        matches = list[tuple[Option, ...]]()
        for choices in islice(self._explaining({}, 0), MAX_MATCHES):
            matches.append(tuple(choices[aspect] for aspect in ASPECTS if aspect in choices))
            model = model_of(matches[-1])
            if all((self._compare(model, case) or 0.0) <= SOLVED for case in cases[::-1]):
                return matches[-1]
        return matches[0] if matches else ()

    def _explaining(self, choices: Choices, index: int) -> Iterator[Choices]:
        """Yield the extensions of a hypothesis that explain the stages from an index on."""
        if index == len(self._stages):
            if self._explains_enough(choices):
                yield choices
            return
        missing = [name for name in self._stages[index].aspects() if name not in choices]
        for options in product(*(self._domains[aspect] for aspect in missing)):
            branch = choices | dict(zip(missing, options, strict=True))
            if compatible(branch) and (self._gap(branch, index) or 0.0) <= SOLVED:
                yield from self._explaining(branch, index + 1)

    def is_double(self) -> bool:
        """Return whether answers in flight have more digits than single precision leaves."""
        first = self._stages[0].name if self._stages else ""
        gaps = [gap for key, gap in self._gaps.items() if key[0] == first and gap is not None]
        return min(gaps, default=1.0) < DOUBLE

    def _explains_enough(self, choices: Choices) -> bool:
        """Return whether no more than a few answers are left out because of singular matrices."""
        explained = [self._gap(choices, i) is not None for i in range(len(self._stages))]
        return any(explained) and 2 * explained.count(True) >= min(8, len(explained))

    def _gap(self, choices: Choices, index: int) -> float | None:
        """Return how far a prediction is from an answer, None where neither is a number of use."""
        return self._compare(model_of([*choices.values()]), self._stages[index])

    def _compare(self, model: StepModel, probe: Probe) -> float | None:
        """Return the same of a model, computed once for all models that it concerns alike."""
        if not (probe.coupled or model.integrator.explicit):
            model = model._replace(integrator=ONE_STEP)
        if (
            probe.answers.keys() == {"positions"}
            and model.substeps == 1
            and not probe.problem.steps
        ):
            is_before = model.scaling.place != "end"
            scaling = model.scaling if is_before else Scaling()
            model = model._replace(velocity="separate", scaling=scaling)
        key = probe.name, len(probe.answers), model
        if key not in self._gaps:
            self._gaps[key] = gap_of(model, probe, self._epsilon)
        return self._gaps[key]


def gap_of(model: StepModel, probe: Probe, epsilon: float) -> float | None:
    """Return how far the step of a model is from an answer, relative to displacements.

    It is None where neither is a number of use.
    """
    prediction = predicted(probe.problem, model, probe.answers.get("positions"))
    if is_singular(prediction):
        return None if is_singular(probe.answers) else np.inf
    allowed = rounding(probe.problem, model, epsilon)
    return relative_gap(probe.problem, prediction, probe.answers, allowed)


def _first_frame(probe: Probe) -> Mapping[str, Any]:
    """Return the answers to a step, or those of the first of several."""
    if not probe.problem.steps:
        return probe.answers
    return {name: frames[0] for name, frames in probe.answers.items()}


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


def honest_options(match: Sequence[Option], greeting: Greeting) -> tuple[Option, ...]:
    """Return the recognised choices of a solver, completed by declared and usual choices."""
    recognised = {option.aspect: option for option in match}
    choices, every = declared_choices(greeting.step), honest(Step(), {})
    usual = {a: (choices[a] or every[a])[0] for a in ASPECTS} | recognised
    if usual["integrator"].choice.explicit:
        for aspect, name in (("damper", "explicit"), ("velocity", "separate")):
            if aspect not in recognised:
                fits = (option for option in choices[aspect] if option.choice == name)
                usual[aspect] = next(fits, usual[aspect])
    return tuple(usual[aspect] for aspect in ASPECTS)
