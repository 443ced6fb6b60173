"""What is found about answers: laws that hold or not, verdicts, and their sum over a task."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from .case import Case
from .contestant import Answer, Failure
from .greeting import Greeting
from .sentence import Sentence, sentence

# The least share of the answers that a fault must reproduce to be told as what is wrong.
LEAST_SHARE = 0.5


class Verdict(IntEnum):
    """How good answers are, from best to worst; the worst law decides."""

    RIGHT = 0
    RIGHT_BUT = 1  # another honest model, stalls, slow, not unit, prints
    UNDECIDED = 2  # below what rounding lets one tell
    WRONG = 3
    BROKEN = 4  # a crash, a hang, garbage, NaN where numbers exist


@dataclass(frozen=True, eq=False)
class Finding:
    """A law, and how an answer stands to it."""

    law: str  # its name, the same for all cases: "link lengths"
    verdict: Verdict
    error: float  # how far the answer is off
    tolerance: float  # what rounding or the solver's own promise allows
    unit: str  # of both: "m", "rad", "" for a ratio
    sentence: Sentence  # what was seen; for a law that holds, what was tried
    index: int | None = None  # joint, spring or particle that is worst, if one is


@dataclass(frozen=True, eq=False)
class CaseJudgement:
    """A case, what was answered, and what was found."""

    case: Case
    answer: Answer | Failure
    findings: tuple[Finding, ...]
    expected: Mapping[str, Any]  # the reference's answer by output, {} if many answers are right
    digits: float | None = None  # correct significant digits, None where that says nothing
    reference_seconds: float | None = None  # what the reference takes for it [s]

    @property
    def verdict(self) -> Verdict:
        """The worst of the findings."""
        if isinstance(self.answer, Failure):
            return Verdict.BROKEN
        return max((finding.verdict for finding in self.findings), default=Verdict.UNDECIDED)


@dataclass(frozen=True, eq=False)
class Explanation:
    """A fault, or several at once, that reproduces wrong answers.

    An entry of `faults` is one key, or several joined by " + " in the order of the computation;
    there is more than one entry where no answer tells them apart.
    """

    faults: tuple[str, ...]
    sentence: Sentence  # what is wrong in the solver, and what it should be
    share: float  # of the answers that were compared, how many it reproduces, 0 to 1
    distance: float  # the largest relative difference from the answers that it reproduces


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Why answers are wrong."""

    explanations: tuple[Explanation, ...] = ()  # nearest first; () if nothing reproduces answers
    behaviour: Sentence | None = None  # what the solver is like, where it did not declare it
    first_broken: Sentence | None = None  # the first law along the computation, if unexplained
    hints: tuple[Sentence, ...] = ()  # what no variant explains: state left over
    variant_count: int = 0  # number of variants that were compared

    @property
    def explained(self) -> bool:
        """Whether a fault is likely."""
        return any(one.share >= LEAST_SHARE for one in self.explanations)


def smallest_failure(judgements: Sequence[CaseJudgement], explained: bool) -> CaseJudgement | None:
    """Return the failing case with the fewest numbers, or None.

    Where no fault explains wrong answers, it is one of those with the worst verdict.
    """
    failing = [one for one in judgements if one.verdict >= Verdict.WRONG]
    if failing and not explained:
        worst = max(one.verdict for one in failing)
        failing = [one for one in failing if one.verdict == worst]
    return min(failing, key=lambda one: one.case.size, default=None)


@dataclass(frozen=True, eq=False)
class TaskReport:
    """All about one task, or one method of inverse kinematics."""

    task: str
    method: str  # of inverse kinematics and tracking, else ""
    judgements: Sequence[CaseJudgement]  # one a case
    diagnosis: Diagnosis
    precision: Sentence | None = None  # why it is judged by another than the greeting's

    @property
    def smallest_failure(self) -> CaseJudgement | None:
        """As of the function `smallest_failure`."""
        return smallest_failure(self.judgements, self.diagnosis.explained)

    @property
    def verdict(self) -> Verdict:
        """The worst of all cases, with a reservation where the precision is another."""
        worst = max((one.verdict for one in self.judgements), default=Verdict.UNDECIDED)
        return max(worst, Verdict.RIGHT_BUT) if self.precision else worst

    @property
    def digits(self) -> float | None:
        """Correct digits in the worst case where they can be counted."""
        known = [one.digits for one in self.judgements if one.digits is not None]
        return min(known, default=None)

    @property
    def untimed(self) -> Sentence | None:
        """Why its time cannot stand beside the reference's, None if it can or that is unknown."""
        answers = [answer for answer, _ in self._timed]
        reasons = [answer.untimed for answer in answers if answer.untimed]
        if answers and not reasons and not any(answer.seconds for answer in answers):
            return sentence('Not timed: "seconds" is 0 in all answers. Use a finer clock.')
        return reasons[0] if reasons else None

    @property
    def slowdown(self) -> float | None:
        """Its time for all cases over the reference's, None if one of them is unknown."""
        if self.untimed or not self._timed:
            return None
        own = sum(answer.seconds for answer, _ in self._timed)
        return own / sum(seconds for _, seconds in self._timed)

    @property
    def _timed(self) -> list[tuple[Answer, float]]:
        """The answers to cases that the reference is timed at, and its times [s]."""
        return [
            (one.answer, one.reference_seconds)
            for one in self.judgements
            if isinstance(one.answer, Answer) and one.reference_seconds
        ]


@dataclass(frozen=True, eq=False)
class Report:
    """What `verify` found: a report for each task, and what concerns them all."""

    greeting: Greeting
    tasks: Sequence[TaskReport]
    seed: int
    remarks: tuple[Sentence, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """The worst of the tasks."""
        return max((task.verdict for task in self.tasks), default=Verdict.UNDECIDED)
