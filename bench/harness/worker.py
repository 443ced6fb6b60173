"""The messages of a worker process, and its side of the connection: jobs in, messages out.

A solver may print, crash or hang, so it works in a process of its own, which `isolation` starts.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.crosscheck.child_process import connect

from ..peers.protocol import describe
from .progress import Progress, listening


class Begun(NamedTuple):
    """The worker has read the job and begins it."""


class Ready(NamedTuple):
    """The solver is set up and has solved a target that does not count.

    Attributes:
        setup: how long the set-up took, without imports [s].
        remark: how to read the solver's numbers, else "".
    """

    setup: float
    remark: str = ""


class Solved(NamedTuple):
    """The answer for a target.

    Attributes:
        q: the coordinates, NaN if there are none.
        claim: 1 if the solver says that it solved the target, 0 if not, -1 if it does not say.
        seconds: how long it took.
        trouble: the exception that the solver raised, else "".
        round_trip: duration of the request, 0 without a request [s].
        doubt: why the seconds that the solver counted cannot be right, else "".
    """

    q: np.ndarray
    claim: int
    seconds: float
    trouble: str
    round_trip: float = 0.0
    doubt: str = ""

    @property
    def overhead(self) -> float:
        """Time of the request that the solver did not use [s]."""
        return max(0.0, self.round_trip - self.seconds)


class Numbers(NamedTuple):
    """The result of a calculation, by name."""

    by_name: Mapping[str, Any]


class Finished(NamedTuple):
    """The last message: the end of the job, of its solver, or of the process.

    Attributes:
        trouble: why the job was not done, "" if it was.
        is_lost: whether the process ended.
        is_silent: whether it was ended for its silence.
    """

    trouble: str = ""
    is_lost: bool = False
    is_silent: bool = False


Message = Begun | Ready | Progress | Solved | Numbers | Finished


class Calculation(NamedTuple):
    """A job that is a call, which returns numbers by name."""

    function: Callable[..., Mapping[str, Any]]
    arguments: tuple[Any, ...]

    def perform(self) -> Iterator[Message]:
        """Yield the numbers."""
        try:
            yield Numbers(self.function(*self.arguments))
            yield Finished()
        except Exception as error:
            yield Finished(describe(error))


def main() -> None:
    """Perform the jobs of the process that started this one until the connection is closed."""
    requests, answers = connect()
    with listening(answers.send):
        while True:
            try:
                job = requests.recv()
            except EOFError:
                return
            except Exception as error:  # a class that cannot be imported here, or has changed
                answers.send(Finished(describe(error)))
                continue
            answers.send(Begun())
            for message in job.perform():
                answers.send(message)
