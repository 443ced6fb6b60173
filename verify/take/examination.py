"""What examiners of a report may use: the solver, and the judgement by another greeting."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from ..case import Case
from ..exchange import Answer, Connection, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, TaskReport, Verdict

# The most requests in which an input is changed.
TRIALS = 3
# Smaller differences between answers are none, in any unit.
SAME = 1e-12


class Examination(Protocol):
    """A solver at a task."""

    @property
    def connection(self) -> Connection:
        """The solver."""

    def judge(self, greeting: Greeting, exchanges: Sequence[Exchange] | None = None) -> TaskReport:
        """Judge the given answers by a greeting, or else answers to suitable requests."""


# An examiner returns the report with its findings, or the same report.
Examiner = Callable[[Examination, TaskReport], TaskReport]


def outputs_of(connection: Connection, case: Case, change: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the outputs of the answer to a changed request, {} without an answer."""
    answer = connection.answer(replace(case, inputs={**case.inputs, **change}))
    return answer.values if isinstance(answer, Answer) else {}


def is_steady(judgement: CaseJudgement) -> bool:
    """Return whether equal requests got equal answers."""
    laws = {finding.law for finding in judgement.findings if finding.verdict >= Verdict.WRONG}
    return "equal answers" not in laws
