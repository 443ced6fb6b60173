"""The interface of adapters, for robots and for cloths.

An adapter for robots is a module with a function `prepare(robot, tolerance, **settings)`. `prepare`
sets the engine up for a robot and returns a function `make_solve(request)`. `make_solve` puts a
target in the engine's own types and returns a `Solve`. Only the solver's own calls are timed:
neither conversions nor set-up count. For an unsuitable robot `prepare` raises `UnableError`. An
adapter with a loop around its solver passes the solver's functions through `clock.library`. If the
engine's kinematics is compared as well, its adapter has a function `kinematics(robot)`, which
returns a `Forward`. A function `prepare_all(robot)` lists all solutions of a pose, and
`prepare_task` takes tasks beyond poses.

An adapter for cloths has a function `prepare(system, frame, **settings)`. `prepare` sets the engine
up for particles and springs and returns a `Mover`, to move the particles a frame at a time. Only
`advance` is timed, and set-up is timed apart. For an unsuitable system `prepare` raises a
`ValueError`.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from plumbob.reference import State
from plumbob.reference.arguments import FloatArray

from ..clock import compute_time_of
from ..problems.evaluate import PoseRequest, Tolerance
from ..problems.robots import BenchRobot, UnableError

__all__ = ["BenchRobot", "FloatArray", "PoseRequest", "Tolerance", "UnableError"]


class OwnTime(NamedTuple):
    """The time measured by a solver or its adapter itself."""

    seconds: float  # by its own clock [s]
    round_trip: float = 0.0  # of its requests, 0 without any [s]
    doubt: str = ""  # why its clock cannot be right, else ""


def total(times: Iterable[OwnTime | None]) -> OwnTime | None:
    """Return the time of several calls, None if no call measured its own."""
    measured = [time for time in times if time is not None]
    if not measured:
        return None
    seconds, round_trips, doubts = zip(*measured, strict=True)
    return OwnTime(sum(seconds), sum(round_trips), max(doubts))


class NoAnswerError(Exception):
    """A solver gave no answer; the message is a sentence with the reason."""


def describe(error: Exception) -> str:
    """Return an exception on a single line; with its type unless a `NoAnswerError`."""
    kind = "" if isinstance(error, NoAnswerError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{error}".split())[:300]


class SolverOutput(NamedTuple):
    """The answer of a solver."""

    q: FloatArray | None  # the coordinates, in the robot's order; None if it returns none
    claim: bool | None  # whether it says that they solve the target; None if it does not say
    # as measured by the adapter or its process; None where the call is timed
    time: OwnTime | None = None
    error: str = ""  # the exception of the solver, else ""


@dataclass(frozen=True, slots=True)
class Solve:
    """A target to solve.

    Attributes:
        call: the calls of the solver by its user for a target, which are timed.
        read: converts what `call` returns to coordinates, None for none, and a claim.
    """

    call: Callable[[], Any]
    read: Callable[[Any], tuple[Any, bool | None]]

    def __call__(self) -> SolverOutput:
        """Return the answer, and the time of `call`."""
        answer, seconds = compute_time_of(self.call)
        return SolverOutput(*self.read(answer), OwnTime(seconds))


SolveFactory = Callable[[PoseRequest], Callable[[], SolverOutput]]
# From coordinates to the transforms of the effectors, (effector, 4, 4), or of the only effector,
# (4, 4).
Forward = Callable[[FloatArray], FloatArray]


class Mover(Protocol):
    """A solver set up for a system and the length of a frame."""

    def begin(self, state: State) -> None:
        """Put the particles into a state; the solver forgets all earlier states."""

    def advance(self) -> OwnTime | None:
        """Move on by a frame; return the solver's own time, None if the call is timed.

        Raises:
            FloatingPointError: if the motion leaves the finite numbers.
        """

    def positions(self) -> FloatArray:
        """Return the positions of the particles [m], (particle, 3), not finite after a blow-up."""
