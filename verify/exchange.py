"""A solver under judgement, and its answers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

from plumbob.text.sentence import Sentence

from .case import Case
from .greeting import Greeting


@dataclass(frozen=True, eq=False)
class Answer:
    """An answer: float64 arrays, numbers and booleans by output, NaN where a number is missing."""

    values: Mapping[str, Any]
    seconds: float  # the solver's own time; if `untimed`, of the round trip, or 0 of a file [s]
    remarks: tuple[Sentence, ...] = ()  # oddities that do not void it: prints, changed inputs
    untimed: Sentence | None = None  # why the seconds are not its own time, None if they are


class FailureKind(StrEnum):
    """Why there is no answer."""

    REFUSED = "refused"  # the solver declines
    RAISED = "raised"
    CRASHED = "crashed"
    HUNG = "hung"
    MEMORY = "memory"
    GARBAGE = "garbage"
    ABSENT = "absent"  # of a folder of answers


@dataclass(frozen=True, eq=False)
class Failure:
    """Why there is no answer, with a sentence."""

    kind: FailureKind
    sentence: Sentence


def is_hung(answer: "Answer | Failure") -> bool:
    """Return whether a request was given no answer in time."""
    return isinstance(answer, Failure) and answer.kind is FailureKind.HUNG


class NoGreetingError(ValueError):
    """A solver sent no greeting, for the reason in `failure`."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(f"solver: expected one that can be started: {failure.sentence}")
        self.failure = failure


@dataclass(frozen=True, eq=False)
class Exchange:
    """A case with the first and the second answer."""

    case: Case
    answer: Answer | Failure
    repeat: Answer | Failure


class Connection(Protocol):
    """Anyone's solver: a function, a program or a folder of answers."""

    @property
    def greeting(self) -> Greeting:
        """Its declaration; raise NoGreetingError without a greeting."""

    @property
    def remarks(self) -> tuple[Sentence, ...]:
        """Oddities apart from its answers; complete after `close`."""

    def answer(self, case: Case) -> Answer | Failure:
        """Send a request; start a lost program again."""

    def close(self) -> None:
        """End the solver with its child processes; the next case starts both again."""


# A function for each task; its arguments are the task's inputs.
Functions = Mapping[str, Callable[..., Any]]
