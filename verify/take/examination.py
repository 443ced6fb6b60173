"""What examiners of a report may use: the solver, and the judgement by another greeting."""

from collections.abc import Callable, Sequence
from typing import Protocol

from ..exchange import Connection, Exchange
from ..greeting import Greeting
from ..judgement import TaskReport


class Examination(Protocol):
    """A solver at a task."""

    @property
    def connection(self) -> Connection:
        """The solver."""

    def judge(self, greeting: Greeting, exchanges: Sequence[Exchange] | None = None) -> TaskReport:
        """Judge answers by a greeting: those given, or else to requests that suit the greeting."""


# An examiner returns the report with what it finds, or the same report.
Examiner = Callable[[Examination, TaskReport], TaskReport]
