"""The search for the cause of wrong answers: its limits, and why the search ended early.

A verdict never depends on this search: a failed, slow or interrupted stage costs the name of the
mistake alone.
"""

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple, TypeVar

from plumbob.text.sentence import Sentence, sentence

from .exchange import Exchange
from .greeting import Greeting
from .judgement import TaskReport

T = TypeVar("T")
# The processor time of the search for the cause of a task's answers [s]. Wall time would make the
# answer depend on other work of the machine.
SECONDS = 20.0
INTERRUPTED = sentence("The search for the cause was interrupted.")


class SearchLimit(BaseException):
    """A search has taken its time; no handler of a stage's own errors catches this."""


class CauseSearch:
    """Stages of the search for the cause of a task's wrong answers."""

    def __init__(self, is_interrupted: bool = False) -> None:
        self.is_interrupted = is_interrupted  # whether the user ended it, or one before
        self.end: Sentence | None = INTERRUPTED if is_interrupted else None  # why it ended early

    @property
    def is_on(self) -> bool:
        """Whether stages run."""
        return self.end is None

    def run(self, stage: Callable[[], T], default: T) -> T:
        """Return the result of a stage, or the default if stage or search have ended early."""
        if not self.is_on:
            return default
        try:
            return stage()
        except SearchLimit:
            self.end = sentence(
                "The search for the cause ended after {seconds:.0f} s of processor time.",
                seconds=SECONDS,
            )
        except KeyboardInterrupt:
            self.end, self.is_interrupted = INTERRUPTED, True
        except Exception as error:
            self.end = sentence(
                "The search for the cause failed ({error}); please report this as a mistake of "
                "Plumbob. The verdict stands.",
                error=f"{type(error).__name__}: {error}",
            )
        return default

    def run_in_time(self, stage: Callable[[], T], default: T) -> T:
        """Return the result of a stage, which may take `SECONDS` of processor time."""

        def run_limited() -> T:
            with _limited():
                return stage()

        return self.run(run_limited, default)


class NoSearch(CauseSearch):
    """A search without stages, which leaves laws and honest methods alone to judge."""

    @property
    def is_on(self) -> bool:
        """Whether stages run."""
        return False


class JudgedAnswers(NamedTuple):
    """Answers to a task with their verdict, and what is known when their cause is sought."""

    report: TaskReport
    greeting: Greeting  # by which they are judged
    search: CauseSearch
    # whether what places joints is right, or wrong for no known reason
    is_placed: bool = True

    @property
    def exchanges(self) -> Sequence[Exchange]:
        """The answers."""
        return self.report.exchanges


def _expire(*_: Any) -> None:
    raise SearchLimit


@contextmanager
def _limited() -> Iterator[None]:
    """Raise SearchLimit in the block after `SECONDS` of processor time, and after as many more.

    Without timers of processor time (on Windows, and outside the main thread) a search ends
    by its number of changes alone.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not (is_main and hasattr(signal, "setitimer")):
        yield
        return
    before = signal.signal(signal.SIGPROF, _expire)
    signal.setitimer(signal.ITIMER_PROF, SECONDS, SECONDS)  # again, for what follows a stage
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
