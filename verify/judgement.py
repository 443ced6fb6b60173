"""Findings about answers, their verdicts, and the reports on tasks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

from plumbob.text.sentence import Sentence, codes_in, sentence

from .case import Case
from .exchange import Answer, Exchange, Failure
from .greeting import Greeting

# The least share of the answers by a likely fault.
LEAST_SHARE = 0.5


class Verdict(IntEnum):
    """How good answers are, from best to worst; the worst law decides."""

    RIGHT = 0
    RIGHT_EXCEPT = 1  # another honest model, stalls, slow, not unit, prints
    UNDECIDED = 2  # too small for the rounding
    WRONG = 3
    BROKEN = 4  # a crash, a hang, garbage, NaN where numbers exist


@dataclass(frozen=True, eq=False)
class Finding:
    """Whether an answer keeps a law."""

    law: str  # its name, the same for all cases: "link lengths"
    verdict: Verdict
    error: float  # of the answer
    tolerance: float  # allowed by rounding or the solver's own promise
    unit: str  # of both: "m", "rad", "" for a ratio
    sentence: Sentence  # the observation
    index: int | None = None  # of the worst joint, spring or particle, if there is one


@dataclass(frozen=True, eq=False)
class CaseJudgement:
    """The findings about the answer to a case."""

    case: Case
    answer: Answer | Failure
    findings: tuple[Finding, ...]
    expected: Mapping[str, Any]  # the reference's answer by output, {} if many answers are right
    digits: float | None = None  # correct significant digits, None if they cannot be counted
    reference_seconds: float | None = None  # time of the reference [s]

    @property
    def verdict(self) -> Verdict:
        """The worst of the findings; a failure has none unless the case allows failures."""
        if isinstance(self.answer, Failure) and not self.findings:
            return Verdict.BROKEN
        return max((finding.verdict for finding in self.findings), default=Verdict.UNDECIDED)

    @property
    def complaints(self) -> list[Sentence]:
        """The sentences about a failure, or about broken laws, the worst first."""
        if isinstance(self.answer, Failure) and not self.findings:
            return [self.answer.sentence]
        broken = [finding for finding in self.findings if finding.verdict is not Verdict.RIGHT]
        return [
            finding.sentence for finding in sorted(broken, key=lambda finding: -finding.verdict)
        ]


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fault, or several at once, with its share of the wrong answers.

    An entry of `faults` is a key, or several keys joined by " + " in the order of the computation;
    several entries have the same answers.
    """

    faults: tuple[str, ...]
    sentence: Sentence  # the mistake in the solver, and its correction
    share: float  # of the compared answers that it reproduces, 0 to 1
    distance: float  # the largest relative difference from the answers that it reproduces

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes in the sentence, in its order."""
        return codes_in(self.sentence)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Why answers are wrong."""

    explanations: tuple[Explanation, ...] = ()  # nearest first
    behaviour: Sentence | None = None  # the inferred model, if it is not declared
    first_broken: Sentence | None = None  # the first law along the computation, if unexplained
    hints: tuple[Sentence, ...] = ()  # at mistakes that no variant has
    is_double: bool = False  # whether the answers have more digits than single precision leaves
    is_certain: bool = False  # whether no other cause is sought
    observations: tuple[Sentence, ...] = ()  # what answers show without any catalogue

    @property
    def share(self) -> float:
        """The share of the answers by the best explanation."""
        return max((explanation.share for explanation in self.explanations), default=0.0)

    @property
    def explained(self) -> bool:
        """Whether a fault is likely."""
        return self.share >= LEAST_SHARE


def smallest_failure(judgements: Sequence[CaseJudgement], explained: bool) -> CaseJudgement | None:
    """Return the failing case with the fewest numbers, of the worst verdict if unexplained."""
    failing = [judgement for judgement in judgements if judgement.verdict >= Verdict.WRONG]
    if failing and not explained:
        worst = max(judgement.verdict for judgement in failing)
        failing = [judgement for judgement in failing if judgement.verdict == worst]
    return min(failing, key=lambda judgement: judgement.case.size, default=None)


def smallest_failures(judgements: Sequence[CaseJudgement], explained: bool) -> list[CaseJudgement]:
    """Return the smallest failure, then the smallest of the other verdict of WRONG and BROKEN."""
    first = smallest_failure(judgements, explained)
    if first is None:
        return []
    remaining = [judgement for judgement in judgements if judgement.verdict != first.verdict]
    other = smallest_failure(remaining, explained)
    return [first] if other is None else [first, other]


@dataclass(frozen=True, eq=False)
class TaskReport:
    """The judgements of a task, or of a method of inverse kinematics."""

    task: str
    method: str  # of inverse kinematics and tracking, else ""
    judgements: Sequence[CaseJudgement]
    diagnosis: Diagnosis
    # the standard beside the greeting: another precision, chains only, a single mass
    assumptions: tuple[Sentence, ...] = ()
    needs_declaration: bool = False  # whether something assumed is a mistake unless it is declared
    exchanges: Sequence[Exchange] = ()
    greeting: Greeting | None = None  # by which they are judged
    original: "TaskReport | None" = None  # by the solver's own greeting, if it is judged by another

    @property
    def smallest_failure(self) -> CaseJudgement | None:
        """The result of the function `smallest_failure`."""
        return smallest_failure(self.judgements, self.diagnosis.explained)

    @property
    def verdict(self) -> Verdict:
        """The worst of all cases, no better than undecided if the user is asked what is meant.

        With a reservation if something is assumed.
        """
        verdicts = (judgement.verdict for judgement in self.judgements)
        worst = max(verdicts, default=Verdict.UNDECIDED)
        if self.needs_declaration:
            return max(worst, Verdict.UNDECIDED)
        return max(worst, Verdict.RIGHT_EXCEPT) if self.assumptions else worst

    @property
    def digits(self) -> float | None:
        """Correct digits in the worst case, of cases with a count."""
        digits = [judgement.digits for judgement in self.judgements]
        return min((count for count in digits if count is not None), default=None)

    @cached_property
    def _times(self) -> list[tuple[Answer, float]]:
        """The answers to cases with times of the reference, and its times [s]."""
        return [
            (judgement.answer, judgement.reference_seconds)
            for judgement in self.judgements
            if isinstance(judgement.answer, Answer) and judgement.reference_seconds
        ]

    @property
    def untimed(self) -> Sentence | None:
        """Why its time cannot be compared with the reference's, or None."""
        reasons = [answer.untimed for answer, _ in self._times if answer.untimed]
        if self._times and not reasons and not any(answer.seconds for answer, _ in self._times):
            return sentence('Not timed: "seconds" is 0 in all answers. Use a finer clock.')
        return reasons[0] if reasons else None

    @property
    def slowdown(self) -> float | None:
        """Its time for all cases over the reference's, None if a time is unknown."""
        if self.untimed or not self._times:
            return None
        own = sum(answer.seconds for answer, _ in self._times)
        return own / sum(seconds for _, seconds in self._times)


@dataclass(frozen=True, eq=False)
class Report:
    """The reports on all tasks of a solver, with remarks on the whole."""

    greeting: Greeting
    tasks: Sequence[TaskReport]
    seed: int
    remarks: tuple[Sentence, ...] = ()
    unjudged: tuple[str, ...] = ()  # the tasks without a verdict, since the judge itself failed

    @property
    def verdict(self) -> Verdict:
        """The worst of the tasks."""
        return max((task.verdict for task in self.tasks), default=Verdict.UNDECIDED)


def first_broken(judgements: Sequence[CaseJudgement], law: str = "") -> Sentence | None:
    """Return a sentence about the first broken law, or a given law, along the computation."""
    for judgement in judgements:
        for finding in judgement.findings:
            if finding.verdict >= Verdict.WRONG and law in ("", finding.law):
                return sentence(
                    "The first violated law is '{law}', in the case '{case}': {why}",
                    law=finding.law,
                    case=judgement.case.name,
                    why=finding.sentence,
                )
    return None
