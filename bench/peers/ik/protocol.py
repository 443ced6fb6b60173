"""The interface of adapters for robots.

An adapter is a module with a function `prepare(robot, tolerance, **settings)`. `prepare` sets the
engine up for a robot and returns a function `ask(request)`. `ask` puts a target in the engine's own
types and returns a `Solve`. Only the solver's own calls are timed: neither conversions nor set-up
count. For an unsuitable robot `prepare` raises `UnableError`. An adapter with a loop around its
solver passes the solver's functions through `clock.library`.

If the engine's kinematics is compared as well, its adapter has a function `kinematics(robot)`,
which returns a `Forward`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from plumbob.reference.arguments import FloatArray

from ...clock import compute_time_of
from ...problems.evaluate import PoseRequest, Tolerance
from ...problems.robots import BenchRobot, UnableError
from ..protocol import OwnTime

__all__ = ["BenchRobot", "FloatArray", "PoseRequest", "Tolerance", "UnableError"]


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


Ask = Callable[[PoseRequest], Callable[[], SolverOutput]]
# From coordinates to the transforms of the effectors, (effector, 4, 4), or of the only effector,
# (4, 4).
Forward = Callable[[FloatArray], FloatArray]
