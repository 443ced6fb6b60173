"""Run jobs in a process of their own; kill it when it stays silent, keep what it sent before."""

import contextlib
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping
from typing import Any, NamedTuple

from plumbob.crosscheck.child_process import (
    SILENT,
    ChildProcess,
    Loss,
    LostError,
    pickled,
    python_process,
)

from .progress import Progress, announce
from .worker import LAST, Begun, Calculation, Done, Found, Lost, Message, Ready, Solved, Unfit, Work

# A worker that says nothing for so long [s] is ended: before it is ready it may compile.
START_PATIENCE = 180.0
TARGET_PATIENCE = 10.0
_START = "import plumbob.bench.harness.worker as w; w.main()"


class Outcome(NamedTuple):
    """What came of a job.

    Attributes:
        setup: how long the solver took to be set up [s].
        solved: the targets that were done, in order.
        trouble: why there are no more, or what was raised and how often; else "".
        is_lost: whether the worker was lost over the next target.
        numbers: what was measured, if that was the job.
        silent: whether the worker was ended since it was silent.
        remark: what the solver's adapter has to say, else "".
    """

    setup: float
    solved: list[Solved]
    trouble: str
    is_lost: bool = False
    numbers: Mapping[str, Any] | None = None
    silent: bool = False
    remark: str = ""

    @property
    def note(self) -> str:
        """Trouble and remark."""
        return "; ".join(filter(None, (self.trouble, self.remark)))


class WorkerProcess:
    """A process that performs jobs, started with the first job and again after it was lost."""

    def __init__(
        self, start_patience: float = START_PATIENCE, target_patience: float = TARGET_PATIENCE
    ) -> None:
        # While it is being set up, and once it is ready.
        self._patience = start_patience, target_patience
        self._worker: ChildProcess | None = None

    @property
    def patience(self) -> float:
        """How long a worker may be silent over a target [s]."""
        return self._patience[True]

    def perform(self, job: Work) -> Outcome:
        """Perform a job and collect its messages, however it ends."""
        outcome, ready = Outcome(0.0, [], ""), False
        with contextlib.closing(self.stream(job)) as messages:
            for message in messages:
                match message:
                    case Ready():
                        outcome, ready = outcome._replace(**message._asdict()), True
                    case Progress():
                        announce(*message)
                    case Solved():
                        outcome.solved.append(message)
                    case Found():
                        outcome = outcome._replace(numbers=message.values)
                    case Unfit():
                        outcome = outcome._replace(trouble=message.why)
                    case Lost(why, silent):
                        outcome = outcome._replace(trouble=why, is_lost=ready, silent=silent)
                    case Done():
                        outcome = outcome._replace(trouble=raised(outcome.solved))
        return _timed_from_outside(outcome)

    def find(self, job: Work) -> Mapping[str, Any]:
        """Return what a job measures.

        Raises:
            RuntimeError: if it measures nothing; the message says why.
        """
        outcome = self.perform(job)
        if outcome.numbers is None:
            raise RuntimeError(outcome.trouble)
        return outcome.numbers

    def stream(self, job: Work) -> Generator[Message, None, None]:
        """Perform a job and yield its messages as they come; the last is Done, Unfit or Lost.

        A worker that was lost since its last job costs nothing: a new one takes the job.
        """
        used = self._worker is not None
        messages = self._once(job)
        first = next(messages)
        if used and isinstance(first, Lost):
            messages = self._once(job)
            first = next(messages)
        if not isinstance(first, Begun):
            yield first
        yield from messages

    def _once(self, job: Work) -> Iterator[Message]:
        ready = False
        try:
            worker = self._worker = self._worker or python_process(_START)
            worker.send(pickled(job))
            message: Message | None = None
            while not isinstance(message, LAST):
                message = _received(worker, self._patience[ready])
                ready = ready or isinstance(message, Ready)
                if isinstance(message, Lost):
                    self.close()
                yield message
        except BaseException:  # what is not finished must not answer the next job
            self.close()
            raise

    def close(self) -> None:
        """End the worker, if there is one, and whatever it has started."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.end()


def _received(worker: ChildProcess, patience: float) -> Message:
    """Return the next message, Lost if there will be none or none came in time [s]."""
    try:
        message = worker.receive(patience)
    except LostError as error:
        if error.loss in SILENT:
            return Lost(f"ended after {patience:g} s of silence", silent=True)
        if error.loss in (Loss.ENDED, Loss.TRUNCATED):
            was = "was " if worker.code < 0 else ""
            return Lost(f"its process {was}ended {worker.ending}")
        message = None
    if isinstance(message, Message):
        return message
    return Lost("its process broke off the connection, or sent what is no message")


def in_a_fresh_process(
    patience: float, function: Callable[..., Mapping[str, Any]], *arguments: Any
) -> Mapping[str, Any]:
    """Return what a call measures in a process that does nothing else, within so long [s].

    Raises:
        RuntimeError: if it raises, or is lost; the message says which.
    """
    with contextlib.closing(WorkerProcess(patience)) as worker:
        return worker.find(Calculation(function, arguments))


def _timed_from_outside(outcome: Outcome) -> Outcome:
    """Return an outcome with the times of round trips if those of the solver cannot be right."""
    if not any(target.doubt for target in outcome.solved):
        return outcome
    solved = [t._replace(seconds=max(t.seconds, t.round_trip)) for t in outcome.solved]
    return outcome._replace(solved=solved)


def raised(solved: list[Solved]) -> str:
    """Return what a solver raised most often and how often, and why its times are not taken.

    It is "" if there is neither.
    """
    counts = Counter(target.trouble for target in solved if target.trouble)
    sentences = [f"{what}, on {n} of {len(solved)} targets" for what, n in counts.most_common(1)]
    sentences += [target.doubt for target in solved if target.doubt][:1]
    return "; ".join(sentences)
