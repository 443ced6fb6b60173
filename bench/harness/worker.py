"""The messages of a worker process, and its side of the connection: jobs in, messages out.

A solver may print, crash or hang: it does so in a process of its own, which `isolation` starts.
Only messages go through the connection.
"""

from collections.abc import Callable, Iterator, Mapping
from multiprocessing.connection import Connection
from typing import Any, NamedTuple, Protocol

import numpy as np

from plumbob.crosscheck.child_process import connect

from ..peers.protocol import describe
from .progress import Progress, listening


class Begun(NamedTuple):
    """The job was read and is begun."""


class Ready(NamedTuple):
    """The solver is set up, in so long [s] without imports, and did one target, not counted.

    Attributes:
        setup: how long that took [s].
        remark: what is to be said of its numbers, else "".
    """

    setup: float
    remark: str = ""


class Solved(NamedTuple):
    """One target is done.

    Attributes:
        q: the coordinates, NaN if there are none.
        claim: 1 if the solver says that it is solved, 0 if not, -1 if it does not say.
        seconds: how long it took.
        trouble: what the solver raised, else "".
        round_trip: how long its door took, 0 without one [s].
        doubt: why the seconds, where it counts them itself, cannot be right, else "".
    """

    q: np.ndarray
    claim: int
    seconds: float
    trouble: str
    round_trip: float = 0.0
    doubt: str = ""

    @property
    def at_door(self) -> float:
        """What its door cost beside it [s]."""
        return max(0.0, self.round_trip - self.seconds)


class Unfit(NamedTuple):
    """The solver cannot do this job; `why` says what came of trying."""

    why: str


class Done(NamedTuple):
    """There is nothing more to come."""


class Found(NamedTuple):
    """What was measured, by name."""

    values: Mapping[str, Any]


class Lost(NamedTuple):
    """The process is gone; `why` says how, `silent` whether it was ended since it was silent."""

    why: str
    silent: bool = False


Message = Begun | Ready | Progress | Solved | Found | Unfit | Done | Lost
# After one of these there is no more to come.
LAST = (Unfit, Done, Lost)


class Work(Protocol):
    """What a worker can be sent: it knows how it is done."""

    def perform(self) -> Iterator[Message]:
        """Yield what comes of it, each part as soon as it is there."""


class Calculation(NamedTuple):
    """A job that is one call, which returns what was measured, by name."""

    function: Callable[..., Mapping[str, Any]]
    arguments: tuple[Any, ...]

    def perform(self) -> Iterator[Message]:
        """Yield what is measured."""
        try:
            yield Found(self.function(*self.arguments))
            yield Done()
        except Exception as error:
            yield Unfit(describe(error))


def serve(requests: Connection, answers: Connection) -> None:
    """Perform jobs until there are no more."""
    with listening(answers.send):
        while True:
            try:
                job = requests.recv()
            except EOFError:
                return
            except Exception as error:  # a class that cannot be imported here, or is another
                answers.send(Unfit(describe(error)))
                continue
            answers.send(Begun())
            for message in job.perform():
                answers.send(message)


def main() -> None:
    """Serve the process that started this one."""
    serve(*connect())
