"""Jobs in a process of their own: a solver may print, raise, crash or hang.

A job has a method `perform`, which yields messages. The worker sends each message at once; the
parent ends a silent worker, and keeps its earlier messages.
"""

import contextlib
import functools
import math
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from plumbob.process import child

from ..peers.protocol import OwnTime, describe
from .progress import Progress, announce, listening

# A worker silent for this long [s] before the first target is ended; it may compile.
START_PATIENCE = 180.0
# And on a target, for which a solver in Python may need seconds.
TARGET_PATIENCE = 60.0
Calculate = Callable[..., Mapping[str, Any]]
_START = "import plumbob.bench.measure.isolation as i; i.main()"


class Started(NamedTuple):
    """The worker has read the job and begins."""


@dataclass(frozen=True)
class Ready:
    """The solver is set up and has solved an uncounted target."""

    setup: float = 0.0  # how long the set-up took, without imports [s]
    remark: str = ""  # how to read the solver's numbers, else ""
    overhead: float = math.nan  # of a solve's time, what the solver does not use [s]
    pace: float = math.nan  # how long a fixed loop takes then [s]


class Solved(NamedTuple):
    """The answer for a target."""

    q: np.ndarray  # the coordinates, NaN if there are none
    claim: int  # 1 if the solver says that it solved the target, 0 if not, -1 if it does not say
    time: OwnTime
    trouble: str = ""  # the exception that the solver raised, else ""

    @property
    def seconds(self) -> float:
        """How long the solve took [s]."""
        return self.time.seconds

    @property
    def duration(self) -> float:
        """How long the answer took, requests included [s]."""
        return max(self.time.seconds, self.time.round_trip)


@dataclass(frozen=True)
class Finished:
    """The last message: the end of the job, of its solver, or of the process."""

    trouble: str = ""  # why there are no more answers, else ""
    is_lost: bool = False  # whether the process ended, in an outcome over the next target
    is_silent: bool = False  # whether the process was ended for its silence
    numbers: Mapping[str, Any] | None = None  # the result of a calculation


Message = Started | Ready | Progress | Solved | Finished


@dataclass(frozen=True)
class JobOutcome(Ready, Finished):
    """The messages of a job in one value; its trouble is, by default, the commonest exception."""

    solved: list[Solved] = field(default_factory=list)  # in the order of the targets

    @property
    def note(self) -> str:
        """Trouble and remark."""
        return "; ".join(filter(None, (self.trouble, self.remark)))


class Calculation(NamedTuple):
    """A call as a job, which returns numbers by name."""

    function: Calculate
    arguments: tuple[Any, ...]

    def perform(self) -> Iterator[Message]:
        """Yield the numbers."""
        try:
            yield Finished(numbers=self.function(*self.arguments))
        except Exception as error:
            yield Finished(describe(error))


class WorkerProcess:
    """A process that performs jobs, started with the first job and again after a loss.

    Attributes:
        patience: how long a worker may be silent over a target [s].
    """

    def __init__(
        self, start_patience: float = START_PATIENCE, target_patience: float = TARGET_PATIENCE
    ) -> None:
        self._start_patience, self.patience = start_patience, target_patience
        self._child: child.ChildProcess | None = None

    def perform(self, job: Any) -> JobOutcome:
        """Perform a job and collect its messages, however it ends."""
        outcome, is_ready = JobOutcome(), False
        with contextlib.closing(self.stream(job)) as messages:
            for message in messages:
                match message:
                    case Progress():
                        announce(*message)
                    case Solved():
                        outcome.solved.append(message)
                    case Ready() | Finished():
                        outcome = replace(outcome, **vars(message))
                        is_ready |= isinstance(message, Ready)
        solved = believed(outcome.solved)
        trouble, is_lost = outcome.trouble or raised(solved), outcome.is_lost and is_ready
        return replace(outcome, solved=solved, trouble=trouble, is_lost=is_lost)

    def calculate(self, function: Calculate, *arguments: Any) -> Mapping[str, Any]:
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
            process = self._child = self._child or child.python_process(_START)
            process.send(child.pickled(job))
            message: Message = Started()
            while not isinstance(message, Finished):
                message = _receive(process, patience)
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
        process, self._child = self._child, None
        if process is not None:
            process.end()


def _receive(process: child.ChildProcess, patience: float) -> Message:
    """Return the next message, or why there is none within so long [s]."""
    trouble = "its process broke off the connection, or sent what is no message"
    try:
        message = process.receive(patience)
        if isinstance(message, Message):
            return message
    except child.LostError as error:
        if error.loss in child.SILENT:
            return Finished(f"ended after {patience:g} s of silence", is_lost=True, is_silent=True)
        if error.loss in (child.Loss.ENDED, child.Loss.TRUNCATED):
            trouble = f"its process {'was ' if process.code < 0 else ''}ended {process.ending}"
    return Finished(trouble, is_lost=True)


def main() -> None:
    """Perform the jobs of the parent process in this worker, until the connection is closed."""
    requests, answers = child.connect()
    with listening(answers.send):
        while True:
            try:
                job = requests.recv()
            except EOFError:
                return
            except Exception as error:  # a class that cannot be imported here, or has changed
                answers.send(Finished(describe(error)))
                continue
            answers.send(Started())
            for message in job.perform():
                answers.send(message)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the process in which all solvers of targets work in turn."""
    return WorkerProcess()


def in_a_fresh_process(patience: float, function: Calculate, *arguments: Any) -> Mapping[str, Any]:
    """Return the numbers of a call in a fresh process, within so long [s].

    Raises:
        RuntimeError: if the call raises or the process is lost; the message says which.
    """
    with contextlib.closing(WorkerProcess(patience)) as worker:
        return worker.calculate(function, *arguments)


def believed(solved: Sequence[Solved]) -> list[Solved]:
    """Return the answers, all timed by round trips if any time by the solver is in doubt."""
    if not any(answer.time.doubt for answer in solved):
        return [*solved]
    return [a._replace(time=a.time._replace(seconds=a.duration)) for a in solved]


def raised(solved: Sequence[Solved]) -> str:
    """Return the most frequent exception with its count, and why times are doubted; else ""."""
    counts = Counter(answer.trouble for answer in solved if answer.trouble)
    sentences = [
        f"{trouble}, on {count:,} of {len(solved):,} targets"
        for trouble, count in counts.most_common(1)
    ]
    sentences += [answer.time.doubt for answer in solved if answer.time.doubt][:1]
    return "; ".join(sentences)
