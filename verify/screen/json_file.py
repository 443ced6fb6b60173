"""The result of `verify` as JSON, versioned; docs/verify.md describes each key."""

from typing import Any, Literal

import msgspec

from plumbob.text.printable import all_visible
from plumbob.text.sentence import Say

from ..exchange import Answer, Failure
from ..judgement import CaseJudgement, Finding, Report, TaskReport
from ..message import plain
from .words import GOOD, advice, remarks

FORMAT: Literal["plumbob verify"] = "plumbob verify"
VERSION: Literal[2] = 2
Record = dict[str, Any]


def text(report: Report, say: Say) -> str:
    """Return the file's text; NaN and infinity are null."""
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


def _name(subject: Report | TaskReport | CaseJudgement | Finding) -> str:
    return subject.verdict.name.lower()


def _task(task: TaskReport, say: Say) -> Record:
    """Return a task, or a method of inverse kinematics."""
    diagnosis = task.diagnosis
    behaviour, first_broken = diagnosis.behaviour, diagnosis.first_broken
    return {
        "task": task.task, "method": task.method, "verdict": _name(task),
        "assumptions": list(map(say, task.assumptions)), "digits": task.digits,
        "slowdown": task.slowdown,
        "passed": sum(judgement.verdict in GOOD for judgement in task.judgements),
        "observations": list(map(say, diagnosis.observations)),
        "explanations": [
            {"faults": explanation.faults, "codes": explanation.codes,
             "text": say(explanation.sentence),
             "share": explanation.share, "distance": explanation.distance}
            for explanation in diagnosis.explanations
        ],
        "behaviour": behaviour and say(behaviour),
        "first_broken": first_broken and say(first_broken),
        "hints": list(map(say, diagnosis.hints)),
        "smallest_failure": task.smallest_failure.case.name if task.smallest_failure else None,
        "cases": [_case(judgement, say) for judgement in task.judgements],
    }  # fmt: skip


def _case(judgement: CaseJudgement, say: Say) -> Record:
    """Return a case; `seconds` is the solver's own time, null if only the round trip was timed."""
    case, answer = judgement.case, judgement.answer
    own = answer if isinstance(answer, Answer) else None
    failure = answer if isinstance(answer, Failure) else None
    return {
        "name": case.name, "family": case.family, "about": say(case.about),
        "class": case.requirement,
        "verdict": _name(judgement), "digits": judgement.digits,
        "seconds": own.seconds if own and not own.untimed else None,
        "reference_seconds": judgement.reference_seconds,
        "failure": failure and failure.kind.value,
        "failure_text": failure and say(failure.sentence),
        "findings": [
            {"law": finding.law, "verdict": _name(finding), "error": finding.error,
             "tolerance": finding.tolerance, "unit": finding.unit, "text": say(finding.sentence),
             "where": finding.index}
            for finding in judgement.findings
        ],
        "remarks": list(map(say, own.remarks)) if own else [],
    }  # fmt: skip
