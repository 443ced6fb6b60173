"""Ask wrong answers again in a new process and in reverse: state kept between requests shows."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from plumbob.text.sentence import Sentence, with_code

from ..exchange import Answer, Connection, is_hung
from ..gaps import difference
from ..judgement import CaseJudgement, Explanation, TaskReport, Verdict
from .examination import Examination, is_steady

NAME = "state kept between requests"
FAULT = tomllib.loads(Path(__file__).with_name("faults.toml").read_text("utf-8"))["state"][NAME]
# The number of repeated requests with wrong answers, the last first.
REQUESTS = 4
# Relative differences of answers by threads with another order of sums stay below this.
SAME = 1e-6
STEPS = ("mass_spring_step", "mass_spring_motion")


def examine(examination: Examination, report: TaskReport) -> TaskReport:
    """Return the report with the fault of answers by earlier requests, if any.

    Other mistakes explain these answers by chance, except steps with a kept matrix or state.
    """
    connection = examination.connection
    is_stuck = any(is_hung(judgement.answer) for judgement in report.judgements)
    if report.verdict < Verdict.WRONG or connection.greeting.system.continues or is_stuck:
        return report
    wrong = [
        judgement
        for judgement in report.judgements
        if isinstance(judgement.answer, Answer) and judgement.verdict >= Verdict.WRONG
        if is_steady(judgement)
    ]
    share = _changed_share(connection, wrong[-REQUESTS:])
    if not share:
        return report
    words = with_code(FAULT["code"], Sentence(FAULT["sentence"], {}))
    explanations = (Explanation((NAME,), words, share, 0.0), *report.diagnosis.explanations)
    is_certain = report.task not in STEPS
    diagnosis = replace(
        report.diagnosis, explanations=explanations, first_broken=None, is_certain=is_certain
    )
    return replace(report, diagnosis=diagnosis)


def _changed_share(connection: Connection, judgements: Sequence[CaseJudgement]) -> float:
    """Return the share of answers with another repeated answer, the last answer first."""
    connection.close()
    changed = 0
    for judgement in reversed(judgements):
        before, answer = judgement.answer, connection.answer(judgement.case)
        assert isinstance(before, Answer)
        changed += not isinstance(answer, Answer) or difference(before.values, answer.values) > SAME
    return changed / max(len(judgements), 1)
