"""The result of `verify` as JSON, versioned; docs/verify.md says what each key holds."""

from typing import Any, Literal

import msgspec

from ..contestant import Answer
from ..judgement import CaseJudgement, Finding, Report, TaskReport
from ..message import plain
from ..sentence import Sentence, all_visible
from .words import GOOD, Say, advice, remarks

FORMAT: Literal["plumbob verify"] = "plumbob verify"
VERSION: Literal[1] = 1
Record = dict[str, Any]


def text(report: Report, say: Say) -> str:
    """Return the file's text; numbers that are not finite are null."""
    fields = all_visible(msgspec.to_builtins(record(report, say), enc_hook=plain))
    return msgspec.json.format(msgspec.json.encode(fields), indent=1).decode() + "\n"


def record(report: Report, say: Say) -> Record:
    """Return the report in plain numbers and words."""
    return {
        "format": FORMAT, "version": VERSION, "verdict": _name(report),
        "passed": report.verdict in GOOD, "seed": report.seed, "solver": report.greeting,
        "remarks": list(map(say, remarks(report))), "advice": say(advice(report.tasks)),
        "tasks": [_task(task, say) for task in report.tasks],
    }  # fmt: skip


def _name(judged: Report | TaskReport | CaseJudgement | Finding) -> str:
    return judged.verdict.name.lower()


def _task(task: TaskReport, say: Say) -> Record:
    """Return a task, or one method of it."""
    found = task.diagnosis
    return {
        "task": task.task, "method": task.method, "verdict": _name(task), "digits": task.digits,
        "slowdown": task.slowdown,
        "passed": sum(one.verdict in GOOD for one in task.judgements),
        "explanations": [
            {"faults": one.faults, "text": say(one.sentence), "share": one.share,
             "distance": one.distance}
            for one in found.explanations
        ],
        "behaviour": _said(found.behaviour, say), "first_broken": _said(found.first_broken, say),
        "hints": list(map(say, found.hints)), "tried": found.variant_count,
        "smallest_failure": task.smallest_failure.case.name if task.smallest_failure else None,
        "cases": [_case(one, say) for one in task.judgements],
    }  # fmt: skip


def _said(words: Sentence | None, say: Say) -> str | None:
    return None if words is None else say(words)


def _case(one: CaseJudgement, say: Say) -> Record:
    """Return a case; `seconds` is the solver's own time, null if only the round trip was timed."""
    case, answer = one.case, one.answer
    failure = None if isinstance(answer, Answer) else answer
    return {
        "name": case.name, "family": case.family, "about": say(case.about), "verdict": _name(one),
        "digits": one.digits,
        "seconds": answer.seconds if isinstance(answer, Answer) and not answer.untimed else None,
        "reference_seconds": one.reference_seconds,
        "failure": failure and failure.kind.value,
        "failure_text": failure and say(failure.sentence),
        "findings": [_finding(finding, say) for finding in one.findings],
        "remarks": list(map(say, answer.remarks)) if isinstance(answer, Answer) else [],
    }  # fmt: skip


def _finding(one: Finding, say: Say) -> Record:
    return {
        "law": one.law, "verdict": _name(one), "error": one.error, "tolerance": one.tolerance,
        "unit": one.unit, "text": say(one.sentence), "where": one.index,
    }  # fmt: skip
