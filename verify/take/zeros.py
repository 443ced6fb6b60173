"""Ask with almost zero in the place of zero: `damping || 1` takes 0 for a missing number."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from plumbob.text.sentence import sentence

from ..exchange import Connection, is_hung
from ..gaps import largest_gap
from ..judgement import CaseJudgement, Explanation, TaskReport, Verdict
from .examination import TRIALS, Examination, is_steady, outputs_of

# Inputs of springs with possible zeros.
NAMES = ("stiffnesses", "dampings", "rest_lengths")
# Almost zero. The change of right answers is about this share of the change by 1 in its place.
# Other answers change as by another number.
ALMOST, JUMP = 1e-6, 1e-2


def examine(examination: Examination, report: TaskReport) -> TaskReport:
    """Return the report on wrong answers, right with almost zero in the place of zero."""
    wrong = [j for j in report.judgements if j.verdict >= Verdict.UNDECIDED]
    if report.verdict < Verdict.UNDECIDED or report.original is not None:
        return report
    if any(is_hung(j.answer) or not is_steady(j) for j in wrong):
        return report
    for name in NAMES:
        concerned = [j for j in wrong if _has_zeros(j, name)]
        if not concerned:
            continue
        if _divides(examination.connection, concerned, name):
            words = sentence(
                "Where {name} are 0 its answers are not finite, and with almost 0 they are: it "
                "divides by these numbers. Leave springs with 0 out of the division.", name=name
            )  # fmt: skip
        elif _jumps(examination.connection, concerned, name):
            words = sentence(
                "Where {name} are 0 its answers are not those of almost 0: it takes 0 for a "
                "missing number, as {name} || 1 or {name} or 1 does. Test whether the number is "
                "missing.", name=name
            )  # fmt: skip
        else:
            continue
        share = len(concerned) / len(wrong)
        explanation = Explanation((f"zero {name}",), words, share, 0.0)
        diagnosis = replace(
            report.diagnosis, explanations=(explanation,), first_broken=None,
            is_certain=share == 1.0,
        )  # fmt: skip
        return replace(report, diagnosis=diagnosis)
    return report


def _has_zeros(judgement: CaseJudgement, name: str) -> bool:
    values = judgement.case.inputs.get(name)
    return values is not None and np.size(values) > 0 and not np.all(values)


def _divides(connection: Connection, judgements: Sequence[CaseJudgement], name: str) -> bool:
    """Return whether answers with zeros are not finite, and answers with almost zeros are."""
    judgements = [j for j in judgements if not _is_finite(getattr(j.answer, "values", {}))]
    for judgement in judgements[:TRIALS]:
        values = np.asarray(judgement.case.inputs[name])
        almost = outputs_of(
            connection, judgement.case, {name: np.where(values == 0.0, ALMOST, values)}
        )
        if not almost or not _is_finite(almost):
            return False
    return bool(judgements)


def _is_finite(outputs: Mapping[str, Any]) -> bool:
    return all(np.isfinite(values).all() for values in outputs.values())


def _jumps(connection: Connection, judgements: Sequence[CaseJudgement], name: str) -> bool:
    """Return whether answers with zeros differ from answers with almost zeros."""
    count = 0
    for judgement in judgements:
        values = np.asarray(judgement.case.inputs[name])
        zero, almost, other = (
            outputs_of(connection, judgement.case, {name: np.where(values == 0.0, number, values)})
            for number in (0.0, ALMOST, 1.0)
        )
        jump, change = _gap(almost, zero), _gap(almost, other)
        if not change > 0.0:
            continue  # nothing depends on the input here
        if not JUMP * change < jump < np.inf:
            return False
        count += 1
        if count == TRIALS:
            break
    return count > 0


def _gap(first: Mapping[str, Any], second: Mapping[str, Any]) -> float:
    return max((largest_gap(first[n], second[n]) for n in first.keys() & second.keys()), default=0)
