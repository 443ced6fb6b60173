"""Find the model of a solver by assuming choices in turn along the probes.

Each probe adds an aspect to the probes before it. A hypothesis makes a choice for each aspect that
has mattered so far. Where no honest choice of the aspects that a probe adds reproduces the answer,
single faults are assumed, then pairs of which one alone brings the answer nearer and the other
moves it. So every fault answers for evidence of its own, and few of the millions of combinations
are tried. All is tried in a fixed order, within a fixed amount of work, on every machine.

A wrong velocity that is a combination of known terms is told from the answers alone. The first step
of a motion is searched as a step, then what a motion adds to it.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import sentence

from ..cause_search import CauseSearch
from ..contestant import Answer, Exchange
from ..greeting import Greeting, Step
from ..judgement import LEAST_SHARE
from .faults import MAX_FAULTS, STEP_FAULTS
from .honest import compatible, declared, honest
from .laws import SOLVED, Rounding, relative_gap, rounding
from .model import RIGHT_MATRIX, Integrator, StepModel, Substep, first_equation, predicted
from .options import ASPECTS, Option, apply
from .pin_strength import measured_pins
from .problem import SpringProblem
from .relations import Sample, fitted, relation_of

# The number of iterations and substeps that predictions with single faults take at one stage, and
# those with pairs: a few seconds each.
WORK, WORK_OF_PAIRS = 40_000, 10_000
# The share of a prediction that each of its iterations takes.
SHARE_OF_ITERATION = 0.2
# The number of hypotheses that are kept from one probe to the next, and of those to which a second
# fault is added: the nearest.
HYPOTHESES, NEAREST = 32, 40
# The number of hypotheses to which faults with a number are fitted.
FITTED = 8
# The complexity of a match with a single fault.
ONE_FAULT = (1, 1)
# The share of the evidence that may stay unexplained beside a fault.
UNEXPLAINED = 0.25
# The iterations that a converged substep takes, about, unless the answer tells its solution.
ITERATIONS_TO_CONVERGE = 10
# Integrators with more iterations are not combined with faults.
MAX_ITERATIONS = 10
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
FAULTY = frozenset(map(id, STEP_FAULTS))
VELOCITIES = [
    fault for fault in STEP_FAULTS if (fault.aspect, fault.rare) == ("velocity", "relation")
]
FRAMES = [fault for fault in STEP_FAULTS if fault.aspect == "frames"]
FACTORISATIONS = [fault for fault in STEP_FAULTS if fault.aspect == "factorisation"]

# An option for each aspect. Where no spring has acted yet, "flight" stands for "integrator": the
# first of those that move free particles alike.
Choices = dict[str, Option]


class SingleFault(NamedTuple):
    """A fault added to a hypothesis that does not explain a stage."""

    branch: Choices
    aspect: str
    option: Option
    gap: float  # between the answer and the prediction with the fault
    before: float  # without the fault

    @property
    def choices(self) -> Choices:
        """The hypothesis with the fault."""
        return self.branch | {self.aspect: self.option}


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
        """The number of faults, and of those that concern a part of the step alone."""
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
        faulty_aspects: Collection[str] | None = None,
        cause_search: CauseSearch | None = None,
        is_honest: bool = False,
    ) -> None:
        """Set up the domains of all choices, with faults of some aspects, of all, or none."""
        faulty_aspects = () if is_honest else faulty_aspects
        step = greeting.step
        self.probes, self.greeting, self.step, self.epsilon = (
            probes, greeting, step, greeting.epsilon,
        )  # fmt: skip
        self.is_honest = is_honest  # whether no fault is assumed
        self.stages = [stage for probe in probes for stage in probe.stages()]
        self.domains = {
            aspect: [
                (option, cost)
                for option, cost in domain
                if not cost or faulty_aspects is None or aspect in faulty_aspects
            ]
            for aspect, domain in domains(step).items()
        }
        honest_pins = [o for o, _ in self.domains["pins"] if id(o) not in FAULTY]
        firsts = [probe.first_step() if probe.problem.steps else probe for probe in probes]
        pins = measured_pins(honest_pins, [(probe.problem, probe.answers) for probe in firsts])
        self.domains["pins"] = sorted(
            [(o, int(not declared(o, step))) for o in pins]
            + [pair for pair in self.domains["pins"] if id(pair[0]) in FAULTY],
            key=lambda pair: pair[1],
        )
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
        self.cause_search = cause_search or CauseSearch()
        self.prediction_count = 0  # number of predictions
        self._work = 0.0  # iterations and substeps that they took
        self._skipped: set[int] = set()  # stages that no hypothesis explains
        self._roundings: dict[tuple[Any, ...], Rounding] = {}
        self._gaps: dict[tuple[Any, ...], float | None] = {}
        self._fitted: list[Option] = []  # which stay, so that no other option gets their id

    def with_probes(self, probes: Sequence[Probe]) -> "ModelSearch":
        """Return the search with more probes."""
        return ModelSearch([*self.probes, *probes], self.greeting, cause_search=self.cause_search)

    def run(self, cases: Sequence[Probe] = ()) -> list[ModelMatch]:
        """Return the matches of the probes with the fewest faults, none if there are none.

        Small probes do not tell where many iterations begin: of several honest steps the one that
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
        # Free flight alone does not tell some honest steps from others with a fault.
        is_flight = not any(stage.coupled for stage in self.stages[: index + 1])
        if not self.is_honest and (is_flight or not self._reproducing(explaining, index)):
            failing = [branch for branch in branches if not self._explains(branch, index)]
            singles = list(self._singles(failing, index))
            explaining += [
                single.choices for single in singles if self._fits(single.choices, index)
            ]
            for fits in (self._with_numbers(failing, index), self._with_flights(failing, index)):
                if not self._reproducing(explaining, index):
                    explaining += [choices for choices in fits if self._fits(choices, index)]
            if not self._skipped and not self._reproducing(explaining, index):
                explaining += [
                    pair for pair in self._pairs(singles, index) if self._fits(pair, index)
                ]
        unique = {frozenset(map(id, choices.values())): choices for choices in explaining}
        ranked = sorted(unique.values(), key=lambda choices: self._rank(choices, index))
        if not self._is_complete(index):
            return ranked
        reproducing = self._varied(self._reproducing(ranked, index))
        unpredicted = [choices for choices in ranked if self._gap(choices, index) is None]
        return reproducing[:HYPOTHESES] + unpredicted[:HYPOTHESES]

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
        """Return the explaining hypotheses that do not merely predict nothing."""
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

    def _singles(self, branches: Sequence[Choices], index: int) -> Iterator[SingleFault]:
        """Yield each hypothesis that fails at a stage with each single fault."""
        limit = self._limit(WORK_OF_PAIRS if self._skipped else WORK)
        branches = sorted(branches, key=_effort)
        trials = [
            (b, aspect, o) for b in branches for aspect, o in self._faults(b, index) if o.at is None
        ]
        for branch, aspect, option in sorted(trials, key=lambda trial: _takes_long(trial[2])):
            before = self._gap(branch, index) or 0.0
            choices = branch | {aspect: option}
            if self._work < limit and compatible(choices):
                gap = self._gap(choices, index) or 0.0
                if gap != before:
                    yield SingleFault(branch, aspect, option, gap, before)

    def _with_numbers(self, branches: Sequence[Choices], index: int) -> Iterator[Choices]:
        """Yield the simplest right hypotheses with each fault that answers tell a number of."""
        stage, limit = self.stages[index], self._limit(WORK_OF_PAIRS)
        for branch in self._simplest_right(branches, index):

            def difference(fault: Option, branch: Choices = branch) -> FloatArray:
                self._spend(_effort(branch))
                options = tuple((branch | {fault.aspect: fault}).values())
                problem, model = apply(options, stage.problem, StepModel(damper="none"))
                prediction = predicted(problem, model, stage.answers.get("positions"))
                if "positions" not in prediction:
                    return np.full(stage.answers["positions"].size, np.inf)
                return (prediction["positions"] - stage.answers["positions"]).ravel()

            faults = [fault for _, fault in self._faults(branch, index) if fault.at is not None]
            allowed = self._rounding(stage, StepModel()).positions
            for fault in faults:
                fit = fitted(fault, difference, allowed) if self._work < limit else None
                yield from self._added(branch, fit)

    def _with_flights(self, branches: Sequence[Choices], index: int) -> Iterator[Choices]:
        """Yield right hypotheses with a flight that is another combination of its terms."""
        if not self.stages[index].coupled:
            for branch in self._simplest_right(branches, index):
                yield from self._added(branch, relation_of("inertia", self._flights()))

    def _simplest_right(self, branches: Sequence[Choices], index: int) -> list[Choices]:
        """Return the hypotheses without faults that take least, of these the nearest."""
        right = [b for b in branches if not (self._cost(b) or self._is_rare(b))]
        distinct = {
            frozenset((k, id(o)) for k, o in b.items() if k != "velocity"): b for b in right
        }
        order = sorted(distinct.values(), key=lambda b: (_effort(b), self._gap(b, index) or 0.0))
        return order[:FITTED]

    def _added(self, branch: Choices, fault: Option | None) -> Iterator[Choices]:
        """Yield a hypothesis, with each right velocity, and a fault made for the answers."""
        if fault is None:
            return
        self._fitted.append(fault)
        self.costs[id(fault)] = 1
        for velocity in (option for option, cost in self.domains["velocity"] if not cost):
            choices = branch | {"velocity": velocity, fault.aspect: fault}
            if compatible(choices):
                yield choices

    def _flights(self) -> list[Sample]:
        """Return the displacements where no spring acts."""
        flights = [probe for probe in self.probes if not (probe.coupled or probe.problem.steps)]
        return [
            Sample(
                probe.answers["positions"] - probe.problem.positions,
                _start(probe.problem).value,
                self._rounding(probe, StepModel()).positions,
            )
            for probe in flights
            if "positions" in probe.answers
        ]

    def _faults(self, branch: Choices, index: int) -> Iterator[tuple[str, Option]]:
        """Yield the faults that may be added to a hypothesis, each with its aspect."""
        faults = [option for option in branch.values() if self.costs[id(option)]]
        if len(faults) >= MAX_FAULTS or self._is_rare(branch) or any(o.rare for o in faults):
            return
        for aspect in self.stages[index].aspects():
            domain = self.domains[aspect]
            if aspect == "integrator" and "flight" in branch:
                aspect, domain = "flight", self.domains["flight"]
            elif aspect == "integrator":
                domain = self.classes[in_flight(branch[aspect].fields["integrator"], self.flight)]
                domain = domain + self.symplectic
            if not self.costs[id(branch[aspect])]:
                yield from ((aspect, o) for o, cost in domain if cost and not (faults and o.rare))

    def _pairs(self, singles: Sequence[SingleFault], index: int) -> Iterator[Choices]:
        """Yield two faults at once: one brings the answer nearer, the other moves it.

        Those of which the first brings it nearest come first.
        """
        limit = self._limit(WORK_OF_PAIRS)
        singles = [
            single for single in singles if not (single.option.rare or _takes_long(single.option))
        ]
        nearer = sorted(
            (single for single in singles if single.gap < single.before),
            key=lambda single: single.gap,
        )
        for first in nearer[:NEAREST]:
            for second in singles:
                if second.branch is first.branch and second.aspect != first.aspect:
                    if self._work >= limit:
                        return
                    yield first.choices | {second.aspect: second.option}

    def _cost(self, choices: Choices) -> int:
        return sum(self.costs[id(option)] for option in choices.values())

    def _is_rare(self, choices: Choices) -> bool:
        """Return whether choices are among those that are not tried together with faults."""
        return any(
            option.rare and option.aspect not in self.declared_aspects
            for option in choices.values()
            if not self.costs[id(option)]
        )

    def _fits(self, choices: Choices, index: int) -> bool:
        """Return whether choices explain the stages up to one, except those that nothing does."""
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
            self._spend(_effort(relevant) if stage.coupled else 1.0)
            self._gaps[key] = self._compare(tuple(relevant.values()), stage)
        return self._gaps[key]

    def _spend(self, effort: float) -> None:
        self._work += effort
        self.cause_search.predictions_left -= 1.0 + SHARE_OF_ITERATION * effort

    def _limit(self, work: float) -> float:
        """Return the sum of work at which to stop after so much more, or none if none is left."""
        return self._work + (work if self.cause_search.predictions_left > 0.0 else 0.0)

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
        if _is_singular(prediction):
            return None if _is_singular(probe.answers) else np.inf
        allowed = self._rounding(probe, model)
        return relative_gap(probe.problem, prediction, probe.answers, allowed)

    def _match(self, choices: Choices) -> ModelMatch:
        if "flight" in choices:
            members = self.classes[choices["flight"].fields["integrator"]]
            choices = {**choices, "integrator": members[0][0]}
        options = tuple(choices[aspect] for aspect in ASPECTS if aspect in choices)
        return ModelMatch(options, tuple(o for o in options if self.costs[id(o)]))


def _start(p: SpringProblem) -> Substep:
    return Substep(p, StepModel(), p.positions, p.velocities, p.h)


def matches_of(search: ModelSearch, cases: Sequence[Probe] = ()) -> list[ModelMatch]:
    """Return the matches of probes of steps or of motions, as `ModelSearch.run` does."""
    probes, epsilon = search.probes, search.epsilon
    if not any(probe.problem.steps for probe in probes):
        return _step_matches(search, cases)
    matches = ModelSearch(probes, search.greeting, ("frames",), search.cause_search).run(cases)
    if matches:
        return matches
    firsts = [probe.first_step() for probe in probes]
    of_steps = ModelSearch(firsts, search.greeting, cause_search=search.cause_search)
    return _with_frames(_step_matches(of_steps, ()), probes, epsilon)


def _step_matches(search: ModelSearch, cases: Sequence[Probe]) -> list[ModelMatch]:
    """Return the matches of steps; a wrong velocity is told without its step where it can be."""
    probes, step, epsilon = search.probes, search.step, search.epsilon
    fault = velocity_fault(probes, epsilon)
    if fault is None:
        return search.run(cases)
    matches = ModelSearch(probes, search.greeting, (), search.cause_search).run(cases)
    if matches:
        return matches
    positions = [probe.positions() for probe in probes]
    position_cases = [case.positions() for case in cases if "positions" in case.answers]
    of_positions = ModelSearch(positions, search.greeting, cause_search=search.cause_search)
    matches = [
        _with_velocity(match, fault, probes, step, epsilon)
        for match in of_positions.run(position_cases)
    ]
    fewest = min((match.complexity for match in matches), default=(MAX_FAULTS, 0))
    further = search.run(cases) if fewest > ONE_FAULT else []
    if further and further[0].complexity < fewest:
        return further
    return [match for match in matches if match.complexity == fewest]


def _with_velocity(
    match: ModelMatch, fault: Option, probes: Sequence[Probe], step: Step, epsilon: float
) -> ModelMatch:
    """Return a match of positions with a right velocity if that explains all, else a fault."""
    for velocity in honest(step)["velocity"]:
        options = tuple(velocity if o.aspect == "velocity" else o for o in match.options)
        if max(gaps_of(options, probes, epsilon)) <= SOLVED:
            return ModelMatch(options, match.faults)
    return _with_fault(match, fault)


def _with_fault(match: ModelMatch, fault: Option) -> ModelMatch:
    options = (option for option in match.options if option.aspect != fault.aspect)
    return ModelMatch((*options, fault), (*match.faults, fault))


def velocity_fault(probes: Sequence[Probe], epsilon: float) -> Option | None:
    """Return the fault that velocities are another combination of known terms than (x' - x) / h."""
    samples = []
    for probe in probes:
        if not {"positions", "velocities"} <= probe.answers.keys():
            return None
        p, x = probe.problem, probe.answers["positions"]
        free = np.setdiff1d(np.arange(p.count), p.pinned)
        start = partial(_start(p).value, d=x - p.positions, x1=x)

        def value(formula: str, start: Any = start, free: Any = free, x: Any = x) -> Any:
            return np.broadcast_to(start(formula), x.shape)[free]

        allowed = rounding(p, StepModel(), epsilon).velocities
        samples.append(Sample(probe.answers["velocities"][free], value, allowed))
    return relation_of("velocity", samples, VELOCITIES)


def _with_frames(
    matches: Sequence[ModelMatch], probes: Sequence[Probe], epsilon: float
) -> list[ModelMatch]:
    """Return the matches of the first steps that explain most motions, with what these add."""
    trials = [trial for match in matches
              for trial in (match, *(_with_fault(match, fault) for fault in FRAMES))]  # fmt: skip
    hits = [sum(gap <= SOLVED for gap in gaps_of(trial.options, probes, epsilon))
            for trial in trials]  # fmt: skip
    best = [trial for trial, count in zip(trials, hits, strict=True) if count == max(hits)]
    fewest = min((trial.complexity for trial in best), default=None)
    return [trial for trial in best if trial.complexity == fewest and trial.faults]


def gaps_of(options: Sequence[Option], probes: Sequence[Probe], epsilon: float) -> list[float]:
    """Return how far answers are from a step with these options, relative to displacements."""
    gaps = []
    for plain, answers, _ in probes:
        p, model = apply(options, plain, StepModel(damper="none"))
        expected, allowed = predicted(p, model), rounding(plain, model, epsilon)
        gaps.append(relative_gap(plain, expected, answers, allowed) if expected else np.inf)
    return gaps


def with_factorisation(
    matches: Sequence[ModelMatch], cases: Sequence[Probe], epsilon: float
) -> list[ModelMatch]:
    """Return the matches, with Cholesky's factorisation unchecked where that explains cases.

    The probes have positive definite matrices. It is to blame if a step is right in all such cases,
    wrong in all others, and there what Eigen's factorisations leave, or no descent of g.
    """
    refined = [_factorised(match, cases, epsilon) for match in matches]
    return [match for match in refined if match] or list(matches)


def _factorised(match: ModelMatch, cases: Sequence[Probe], epsilon: float) -> ModelMatch | None:
    if any(fault.aspect == "matrix" for fault in match.faults):
        return None
    gaps = np.array(gaps_of(match.options, cases, epsilon))
    is_indefinite = np.array([_is_indefinite(match, case) for case in cases], dtype=bool)
    if not is_indefinite.any() or ((gaps > SOLVED) != is_indefinite).any():
        return None
    indefinite = [case for case, is_one in zip(cases, is_indefinite, strict=True) if is_one]
    for fault in FACTORISATIONS:
        options = (*match.options, fault)
        gaps = np.array(gaps_of(options, indefinite, epsilon))
        if np.mean(gaps <= SOLVED) >= LEAST_SHARE:
            return ModelMatch(options, (*match.faults, fault))
    if any(_ascends(match, case) for case in indefinite):
        return ModelMatch(match.options, (*match.faults, FACTORISATIONS[0]))
    return None


def _is_indefinite(match: ModelMatch, case: Probe) -> bool:
    """Return whether a step meets a matrix that Cholesky's method cannot factorise."""
    p, model = apply(match.options, case.problem, StepModel(damper="none"))
    if model.integrator.method != "newton" or p.steps:
        return False
    solved = predicted(p, model)
    unsolved = predicted(p, model._replace(factorisation="displacement"))
    return bool(solved) and not np.array_equal(solved["positions"], unsolved["positions"])


def _ascends(match: ModelMatch, case: Probe) -> bool:
    """Return whether a Newton step, however its matrix was corrected, could not go that way."""
    p, model = apply(match.options, case.problem, StepModel(damper="none"))
    if (model.integrator.iterations, model.substeps) != (1, 1) or "positions" not in case.answers:
        return False
    equation = first_equation(p, model)
    start = equation.starts[model.integrator.start]
    step = case.answers["positions"] - start
    return not float((equation.free_gradient(start) * step).sum()) < 0.0


def _is_singular(values: Mapping[str, Any]) -> bool:
    """Return whether positions are missing or huge, as from a singular matrix."""
    return "positions" not in values or not np.abs(values["positions"]).max() < LARGEST


def fields_of(choices: Choices) -> dict[str, Any]:
    """Return the fields of a model that choices replace."""
    return {k: value for option in choices.values() for k, value in option.fields.items()}


def _effort(choices: Choices) -> float:
    """Return how many iterations, or a few substeps of explicit methods, a prediction takes."""
    fields = fields_of(choices)
    integrator, substeps = fields["integrator"], fields["substeps"]
    iterations = 0.3 if integrator.explicit else integrator.iterations
    if integrator.method == "converged" and substeps > 1:
        iterations = ITERATIONS_TO_CONVERGE
    return float(1.0 + substeps * iterations)


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

    One that solves for the minimum stands for all others that do: the usual one.
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


def domains(step: Step) -> dict[str, list[tuple[Option, int]]]:
    """Return, for each aspect, all choices with their costs, cost 0 first."""
    right = honest(step)
    costs: dict[str, list[tuple[Option, int]]] = {}
    for aspect in ASPECTS:
        options = [(option, int(not declared(option, step))) for option in right.get(aspect, ())]
        if not options:
            options = [(Option("", aspect, sentence("as it should be")), 0)]
        faults = (fault for fault in STEP_FAULTS if fault.aspect == aspect)
        # what a velocity is a combination of shows without a search, but not in several substeps
        is_shown = step.substeps in (None, 1)
        options += [(fault, 1) for fault in faults if fault.rare != "relation" or not is_shown]
        costs[aspect] = sorted(options, key=lambda pair: pair[1])
    return costs
