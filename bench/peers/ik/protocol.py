"""What the bench asks of a solver for robots.

An adapter is a module with one function, `prepare(robot, tolerance, **settings)`: it sets the
engine up once for a robot and returns a function `ask(positions, rotations, start)`. That puts one
target in the engine's own types and returns the call to be timed, which returns a `SolverOutput`:
neither conversions nor set-up count as time of a solve. For a robot that it cannot solve `prepare`
raises `UnableError`.

An adapter of an engine whose kinematics is compared as well has a function `kinematics(robot)`,
which returns a `Forward`.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from plumbob.reference.arguments import FloatArray

from ...experiments.robots.problem import Robot
from ...harness.worker import describe


class SolverOutput(NamedTuple):
    """What a solver found.

    Attributes:
        q: the coordinates, in the robot's order; None if it returns none.
        claimed: whether it says that they solve the target; None if it does not say.
        seconds: what the adapter or its process has measured [s]; None where the call is timed.
        error: what the solver raised, else "".
    """

    q: FloatArray | None
    claimed: bool | None
    seconds: float | None = None
    error: str = ""


Solve = Callable[[], SolverOutput]


def attempt(solve: Solve) -> SolverOutput:
    """Return what a solve returns; one that raises is a failed attempt, with what it raised."""
    try:
        return solve()
    except Exception as error:  # whatever an engine raises is its result
        return SolverOutput(None, False, error=describe(error))


class Ask(Protocol):
    """A solver that is set up for a robot."""

    def __call__(self, positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        """Return the call that solves one target.

        Args:
            positions: of the effectors [m], (effector, 3).
            rotations: of the effectors, (effector, 3, 3).
            start: coordinates, (coordinate,).
        """


# Coordinates to the effectors' positions [m], (effector, 3), and rotations, (effector, 3, 3).
Forward = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def remark_of(adapter: Any) -> str:
    """Return what an adapter has to say of its numbers, by a function `remark`, else ""."""
    return str(adapter.remark()) if hasattr(adapter, "remark") else ""


class UnableError(ValueError):
    """What a solver cannot do by its making; the message says what."""


def needs_a_chain(robot: Robot) -> None:
    """Raise unless the robot is a chain of hinges with one effector.

    Raises:
        UnableError: if it is not.
    """
    if not robot.is_chain:
        raise UnableError("takes one chain of hinges only")
