"""A solver under judgement, whatever door it came through, and what it answers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

from .case import Case
from .greeting import Greeting
from .sentence import Sentence


@dataclass(frozen=True, eq=False)
class Answer:
    """What a solver answered.

    The values are float64 arrays, numbers and booleans of the task's shapes, by the names of its
    outputs; NaN where it gave none.
    """

    values: Mapping[str, Any]
    seconds: float  # the solver's own time; if `untimed`, of the round trip, or 0 of a file [s]
    remarks: tuple[Sentence, ...] = ()  # what was odd without voiding it: prints, changed inputs
    untimed: Sentence | None = None  # why the seconds are not its own time, None if they are


class FailureKind(StrEnum):
    """Why there is no answer."""

    REFUSED = "refused"  # it says that it cannot
    RAISED = "raised"
    CRASHED = "crashed"
    HUNG = "hung"
    MEMORY = "memory"
    GARBAGE = "garbage"
    ABSENT = "absent"  # of a folder of answers


@dataclass(frozen=True, eq=False)
class Failure:
    """Why there is no answer, with a sentence for people."""

    kind: FailureKind
    sentence: Sentence


class NoGreetingError(ValueError):
    """A solver did not say what it is, so that nothing can be asked; `failure` says why."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(f"solver: expected one that can be started: {failure.sentence}")
        self.failure = failure


@dataclass(frozen=True, eq=False)
class Exchange:
    """A case, and what was answered the first and the second time."""

    case: Case
    answer: Answer | Failure
    repeat: Answer | Failure


class Contestant(Protocol):
    """Anyone's solver, behind one of the doors."""

    @property
    def greeting(self) -> Greeting:
        """What it says of itself.

        Raises:
            NoGreetingError: if it cannot be had.
        """

    @property
    def remarks(self) -> tuple[Sentence, ...]:
        """What was odd apart from its answers; complete when it is closed."""

    def answer(self, case: Case) -> Answer | Failure:
        """Ask it; start it again if it was lost."""

    def close(self) -> None:
        """End it, and whatever it has started; the next case starts it anew."""


# A solver of ours or of an engine: a function for each task, by the names of its inputs.
Functions = Mapping[str, Callable[..., Any]]
