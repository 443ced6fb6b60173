"""Find the faults of a step along the probes that its honest model is sought by.

Where no honest choice of the aspects that a probe adds reproduces the answer,
single faults are assumed, then pairs of which one alone brings the answer nearer and the other
moves it. So every fault answers for evidence of its own, and few of the millions of combinations
are tried. All is tried in a fixed order, within a fixed amount of work, on every machine.

A wrong velocity that is a combination of known terms is told from the answers alone. The first step
of a motion is searched as a step, then what a motion adds to it.
"""

from collections.abc import Collection, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..cause_search import CauseSearch
from ..greeting import Greeting, Step
from ..judgement import LEAST_SHARE
from .faults import STEP_FAULTS
from .honest import compatible, honest
from .laws import SOLVED, rounding
from .model import StepModel, Substep, first_equation, predicted
from .model_search import (
    Choices,
    ModelMatch,
    ModelSearch,
    Probe,
    effort_of,
    gaps_of,
    in_flight,
)
from .options import ASPECTS, MAX_FAULTS, Option, apply
from .problem import SpringProblem
from .relations import Sample, fitted, relation_of

# The share of a prediction that each of its iterations takes.
SHARE_OF_ITERATION = 0.2
# The number of iterations and substeps that predictions with single faults take at one stage, and
# those with pairs: a few seconds each.
WORK, WORK_OF_PAIRS = 40_000, 10_000
# The number of hypotheses to which a second fault is added: the nearest.
NEAREST = 40
# The number of hypotheses to which faults with a number are fitted.
FITTED = 8
# The complexity of a match with a single fault.
ONE_FAULT = (1, 1)
# Integrators with more iterations are not combined with faults.
MAX_ITERATIONS = 10
FAULTY = frozenset(map(id, STEP_FAULTS))
VELOCITIES = [
    fault for fault in STEP_FAULTS if (fault.aspect, fault.rare) == ("velocity", "relation")
]
FRAMES = [fault for fault in STEP_FAULTS if fault.aspect == "frames"]
FACTORISATIONS = [fault for fault in STEP_FAULTS if fault.aspect == "factorisation"]


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


class FaultSearch(ModelSearch):
    """The search of the choices, right or wrong, that explain a solver's answers to the probes."""

    def __init__(
        self,
        probes: Sequence[Probe],
        greeting: Greeting,
        cause_search: CauseSearch,
        aspects: Collection[str] | None = None,
    ) -> None:
        """Set up the domains of all choices, with faults of some aspects, or of all."""
        # what a velocity is a combination of shows without a search, but not in several substeps
        is_shown = greeting.step.substeps in (None, 1)
        faults = {
            aspect: [
                fault
                for fault in STEP_FAULTS
                if fault.aspect == aspect and (fault.rare != "relation" or not is_shown)
            ]
            for aspect in (ASPECTS if aspects is None else aspects)
        }
        super().__init__(probes, greeting, aspects, faults)
        self.cause_search = cause_search
        self._fitted: list[Option] = []  # which stay, so that no other option gets their id

    def _with_faults(
        self, branches: Sequence[Choices], explaining: Sequence[Choices], index: int
    ) -> list[Choices]:
        """Return hypotheses with single faults, else with fitted ones, else with pairs of faults.

        Free flight alone does not tell some honest steps from others with a fault.
        """
        is_flight = not any(stage.coupled for stage in self.stages[: index + 1])
        if not is_flight and self._reproducing(explaining, index):
            return []
        failing = [branch for branch in branches if not self._explains(branch, index)]
        singles = list(self._singles(failing, index))
        found = [single.choices for single in singles if self._fits(single.choices, index)]
        for fits in (self._with_numbers(failing, index), self._with_flights(failing, index)):
            if not self._reproducing([*explaining, *found], index):
                found += [choices for choices in fits if self._fits(choices, index)]
        if not self._skipped and not self._reproducing([*explaining, *found], index):
            found += [pair for pair in self._pairs(singles, index) if self._fits(pair, index)]
        return found

    def _spend(self, effort: float) -> None:
        super()._spend(effort)
        self.cause_search.predictions_left -= 1.0 + SHARE_OF_ITERATION * effort

    def with_probes(self, probes: Sequence[Probe]) -> "FaultSearch":
        """Return the search with more probes."""
        return FaultSearch([*self.probes, *probes], self.greeting, self.cause_search)

    def _singles(self, branches: Sequence[Choices], index: int) -> Iterator[SingleFault]:
        """Yield each hypothesis that fails at a stage with each single fault."""
        limit = self._limit(WORK_OF_PAIRS if self._skipped else WORK)
        branches = sorted(branches, key=effort_of)
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
                self._spend(effort_of(branch))
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
        order = sorted(distinct.values(), key=lambda b: (effort_of(b), self._gap(b, index) or 0.0))
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

    def _limit(self, work: float) -> float:
        """Return the sum of work at which to stop after so much more, or none if none is left."""
        return self._work + (work if self.cause_search.predictions_left > 0.0 else 0.0)


def _start(p: SpringProblem) -> Substep:
    return Substep(p, StepModel(), p.positions, p.velocities, p.h)


def matches_of(search: FaultSearch, cases: Sequence[Probe] = ()) -> list[ModelMatch]:
    """Return the matches of probes of steps or of motions, as `ModelSearch.run` does."""
    probes, epsilon = search.probes, search.epsilon
    if not any(probe.problem.steps for probe in probes):
        return _step_matches(search, cases)
    matches = FaultSearch(probes, search.greeting, search.cause_search, ("frames",)).run(cases)
    if matches:
        return matches
    firsts = [probe.first_step() for probe in probes]
    of_steps = FaultSearch(firsts, search.greeting, search.cause_search)
    return _with_frames(_step_matches(of_steps, ()), probes, epsilon)


def _step_matches(search: FaultSearch, cases: Sequence[Probe]) -> list[ModelMatch]:
    """Return the matches of steps; a wrong velocity is told without its step where it can be."""
    probes, step, epsilon = search.probes, search.step, search.epsilon
    fault = velocity_fault(probes, epsilon)
    if fault is None:
        return search.run(cases)
    matches = FaultSearch(probes, search.greeting, search.cause_search, ()).run(cases)
    if matches:
        return matches
    positions = [probe.positions() for probe in probes]
    position_cases = [case.positions() for case in cases if "positions" in case.answers]
    of_positions = FaultSearch(positions, search.greeting, search.cause_search)
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
