"""The result of `verify` as JSON, typed and versioned; docs/verify.md says what each key holds."""

from typing import Literal

import msgspec

from plumbob.bench.text import all_visible

from ..contestant import Answer
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, Report, TaskReport
from ..message import plain
from .words import GOOD, Say, advice, passed, remarks

FORMAT: Literal["plumbob verify"] = "plumbob verify"
VERSION: Literal[1] = 1
VerdictName = Literal["right", "right_but", "undecided", "wrong", "broken"]


class FindingRecord(msgspec.Struct, frozen=True):
    """A law and how an answer stands to it; error and tolerance in `unit`, null if not finite."""

    law: str
    verdict: VerdictName
    error: float | None
    tolerance: float | None
    unit: str
    text: str
    where: int | None


class CaseRecord(msgspec.Struct, frozen=True):
    """A case; `failure` is the kind of a missing answer, or null.

    `seconds` is the solver's own time, null if only the round trip was timed.
    """

    name: str
    family: str
    about: str
    verdict: VerdictName
    digits: float | None
    seconds: float | None
    reference_seconds: float | None
    failure: str | None
    failure_text: str | None
    findings: list[FindingRecord]
    remarks: list[str]


class ExplanationRecord(msgspec.Struct, frozen=True):
    """Faults that reproduce wrong answers: their keys, a sentence, and what share of answers."""

    faults: list[str]
    text: str
    share: float
    distance: float | None


class TaskRecord(msgspec.Struct, frozen=True):
    """A task, or one method of it."""

    task: str
    method: str
    verdict: VerdictName
    digits: float | None
    slowdown: float | None
    passed: int
    explanations: list[ExplanationRecord]
    behaviour: str | None
    first_broken: str | None
    hints: list[str]
    tried: int
    smallest_failure: str | None
    cases: list[CaseRecord]


class ReportRecord(msgspec.Struct, frozen=True):
    """All that was found."""

    format: Literal["plumbob verify"]
    version: Literal[1]
    verdict: VerdictName
    passed: bool
    seed: int
    solver: Greeting
    remarks: list[str]
    advice: str
    tasks: list[TaskRecord]


def text(report: Report, say: Say) -> str:
    """Return the file's text."""
    fields = all_visible(msgspec.to_builtins(record(report, say), enc_hook=plain))
    return msgspec.json.format(msgspec.json.encode(fields), indent=1).decode() + "\n"


def record(report: Report, say: Say) -> ReportRecord:
    """Return the report in plain numbers and words."""
    return ReportRecord(
        FORMAT, VERSION, _name(report), report.verdict in GOOD, report.seed,
        report.greeting,
        [say(one) for one in remarks(report)], say(advice(report.tasks)),
        [_task(task, say) for task in report.tasks],
    )  # fmt: skip


def _name(judged: Report | TaskReport | CaseJudgement | Finding) -> VerdictName:
    name: VerdictName = judged.verdict.name.lower()  # type: ignore[assignment]
    return name


def _task(task: TaskReport, say: Say) -> TaskRecord:
    found = task.diagnosis
    explained = [
        ExplanationRecord([*map(str, one.faults)], say(one.sentence), one.share, one.distance)
        for one in found.explanations
    ]
    return TaskRecord(
        task.task, task.method, _name(task), task.digits, task.slowdown, passed(task),
        explained,
        say(found.behaviour) if found.behaviour else None,
        say(found.first_broken) if found.first_broken else None,
        [say(hint) for hint in found.hints], found.tried,
        task.smallest_failure.case.name if task.smallest_failure else None,
        [_case(one, say) for one in task.judgements],
    )  # fmt: skip


def _case(one: CaseJudgement, say: Say) -> CaseRecord:
    case, answer = one.case, one.answer
    return CaseRecord(
        case.name, case.family, say(case.about), _name(one), one.digits,
        answer.seconds if isinstance(answer, Answer) and not answer.untimed else None,
        one.reference_seconds,
        None if isinstance(answer, Answer) else answer.kind.value,
        None if isinstance(answer, Answer) else say(answer.sentence),
        [_finding(finding, say) for finding in one.findings],
        [say(remark) for remark in answer.remarks] if isinstance(answer, Answer) else [],
    )  # fmt: skip


def _finding(one: Finding, say: Say) -> FindingRecord:
    return FindingRecord(
        one.law, _name(one), one.error, one.tolerance, one.unit, say(one.sentence), one.where
    )
