"""Run jobs in a process of their own; end a silent process, keep its earlier messages."""

import contextlib
import math
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from plumbob.process.child import SILENT, ChildProcess, Loss, LostError, pickled, python_process

from .progress import Progress, announce
from .worker import Calculation, Finished, Lap, Message, Numbers, Ready, Solved, Started

# A worker silent for this long [s] is ended; before ready, a worker may compile.
START_PATIENCE = 180.0
TARGET_PATIENCE = 60.0
Calculate = Callable[..., Mapping[str, Any]]
_START = "import plumbob.bench.harness.worker as w; w.main()"


class JobOutcome(NamedTuple):
    """The result of a job."""

    setup: float  # how long the set-up of the solver took [s]
    solved: list[Solved]  # the answers, in the order of the targets
    trouble: str  # why there are no more, or the most frequent exception; else ""
    is_lost: bool = False  # whether the worker was lost over the next target
    numbers: Mapping[str, Any] | None = None  # the result of a calculation
    is_silent: bool = False  # whether the worker was ended for its silence
    remark: str = ""  # the remark of the solver's adapter, else ""
    laps: Sequence[Lap] = ()  # the times of solvers in turns
    overhead: float = math.nan  # of a solve's time, what the solver does not use [s]

    @property
    def note(self) -> str:
        """Trouble and remark."""
        return "; ".join(filter(None, (self.trouble, self.remark)))


class WorkerProcess:
    """A process that performs jobs, started with the first job and again after a loss.

    Attributes:
        patience: how long a worker may be silent over a target [s].
    """

    def __init__(
        self, start_patience: float = START_PATIENCE, target_patience: float = TARGET_PATIENCE
    ) -> None:
        self._start_patience, self.patience = start_patience, target_patience
        self._child: ChildProcess | None = None

    def perform(self, job: Any) -> JobOutcome:
        """Perform a job and collect its messages, however it ends."""
        outcome, is_ready = JobOutcome(0.0, [], ""), False
        with contextlib.closing(self.stream(job)) as messages:
            for message in messages:
                match message:
                    case Ready():
                        outcome, is_ready = outcome._replace(**message._asdict()), True
                    case Progress():
                        announce(*message)
                    case Solved():
                        outcome.solved.append(message)
                    case Lap():
                        outcome = outcome._replace(laps=[*outcome.laps, message])
                    case Numbers(by_name):
                        outcome = outcome._replace(numbers=by_name)
                    case Finished(trouble, is_lost, is_silent):
                        outcome = outcome._replace(
                            trouble=trouble or raised(outcome.solved),
                            is_lost=is_lost and is_ready,
                            is_silent=is_silent,
                        )
        if any(target.doubt for target in outcome.solved):  # then all times are round trips
            solved = [
                target._replace(seconds=max(target.seconds, target.round_trip))
                for target in outcome.solved
            ]
            outcome = outcome._replace(solved=solved)
        return outcome

    def calculate(
        self, function: Callable[..., Mapping[str, Any]], *arguments: Any
    ) -> Mapping[str, Any]:
        """Return the numbers of a call.

        Raises:
            RuntimeError: if the call raises or the process is lost; the message says which.
        """
        outcome = self.perform(Calculation(function, arguments))
        if outcome.numbers is None:
            raise RuntimeError(outcome.trouble)
        return outcome.numbers

    def stream(self, job: Any) -> Generator[Message, None, None]:
        """Perform a job and yield its messages on arrival; the last is `Finished`.

        A worker lost since its last job costs nothing: a new worker takes the job.
        """
        is_used = self._child is not None
        messages = self._messages(job)
        first = next(messages)
        if is_used and isinstance(first, Finished) and first.is_lost:
            messages = self._messages(job)
            first = next(messages)
        if not isinstance(first, Started):
            yield first
        yield from messages

    def _messages(self, job: Any) -> Iterator[Message]:
        patience = self._start_patience
        try:
            child = self._child = self._child or python_process(_START)
            child.send(pickled(job))
            message: Message = Started()
            while not isinstance(message, Finished):
                message = _receive(child, patience)
                if isinstance(message, Ready):
                    patience = self.patience
                elif isinstance(message, Finished) and message.is_lost:
                    self.close()
                yield message
        except BaseException:  # an unfinished job must not answer the next one
            self.close()
            raise

    def close(self) -> None:
        """End the worker, if any, with all processes started by the worker."""
        child, self._child = self._child, None
        if child is not None:
            child.end()


def _receive(child: ChildProcess, patience: float) -> Message:
    """Return the next message, or why there is none within so long [s]."""
    trouble = "its process broke off the connection, or sent what is no message"
    try:
        message = child.receive(patience)
        if isinstance(message, Message):
            return message
    except LostError as error:
        if error.loss in SILENT:
            return Finished(f"ended after {patience:g} s of silence", is_lost=True, is_silent=True)
        if error.loss in (Loss.ENDED, Loss.TRUNCATED):
            trouble = f"its process {'was ' if child.code < 0 else ''}ended {child.ending}"
    return Finished(trouble, is_lost=True)


def in_a_fresh_process(patience: float, function: Calculate, *arguments: Any) -> Mapping[str, Any]:
    """Return the numbers of a call in a fresh process, within so long [s].

    Raises:
        RuntimeError: if the call raises or the process is lost; the message says which.
    """
    with contextlib.closing(WorkerProcess(patience)) as worker:
        return worker.calculate(function, *arguments)


def raised(solved: list[Solved]) -> str:
    """Return the most frequent exception with its count, and why times are doubted; else ""."""
    counts = Counter(target.trouble for target in solved if target.trouble)
    sentences = [
        f"{trouble}, on {count:,} of {len(solved):,} targets"
        for trouble, count in counts.most_common(1)
    ]
    sentences += [target.doubt for target in solved if target.doubt][:1]
    return "; ".join(sentences)
