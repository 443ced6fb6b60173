"""The messages of a worker process, and its side of the connection: jobs in, messages out.

A solver may print, crash or hang, and so works in a process of its own, started by `isolation`.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.process.child import connect

from ..peers.protocol import OwnTime, describe
from .progress import Progress, listening


class Started(NamedTuple):
    """The worker has read the job and begins."""


class Ready(NamedTuple):
    """The solver is set up and has solved an uncounted target."""

    setup: float  # how long the set-up took, without imports [s]
    remark: str = ""  # how to read the solver's numbers, else ""
    overhead: float = math.nan  # of a solve's time, what the solver does not use [s]


class Solved(NamedTuple):
    """The answer for a target."""

    q: np.ndarray  # the coordinates, NaN if there are none
    claim: int  # 1 if the solver says that it solved the target, 0 if not, -1 if it does not say
    seconds: float  # how long it took
    trouble: str  # the exception that the solver raised, else ""
    round_trip: float = 0.0  # duration of the request, 0 without a request [s]
    doubt: str = ""  # why the seconds that the solver counted cannot be right, else ""


class Lap(NamedTuple):
    """A part of a solver's times in a round; without times, the part begins."""

    number: int  # of the solver
    times: tuple[OwnTime, ...] = ()  # of successive targets
    control: float = 0.0  # how long a fixed loop took right before, where the round begins [s]


class Numbers(NamedTuple):
    """The result of a calculation, by name."""

    by_name: Mapping[str, Any]


class Finished(NamedTuple):
    """The last message: the end of the job, of its solver, or of the process."""

    trouble: str = ""  # why the job was not done, "" if it was
    is_lost: bool = False  # whether the process ended
    is_silent: bool = False  # whether it was ended for its silence


Message = Started | Ready | Progress | Solved | Lap | Numbers | Finished


class Calculation(NamedTuple):
    """A call as a job, which returns numbers by name."""

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
    """Perform the jobs of the parent process until the connection is closed."""
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
            answers.send(Started())
            for message in job.perform():
                answers.send(message)
