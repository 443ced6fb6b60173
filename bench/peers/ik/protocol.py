"""What the bench asks of a solver for robots.

An adapter is a module with one function, `prepare(robot, tolerance, **settings)`: it sets the
engine up once for a robot and returns a function `ask(positions, rotations, start)`. That puts one
target in the engine's own types and returns the call to be timed, which returns a `SolverOutput`:
neither conversions nor set-up count as time of a solve. For a robot that it cannot solve `prepare`
raises `UnableError`.

An adapter of an engine whose kinematics is compared as well has a function `kinematics(robot)`,
which returns a `Forward`.
"""

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from plumbob.reference.arguments import FloatArray

from ...problems.evaluate import Tolerance
from ...problems.robots import Robot
from ..protocol import OwnTime, UnableError, describe

__all__ = ["FloatArray", "Robot", "Tolerance", "UnableError"]


class SolverOutput(NamedTuple):
    """What a solver found.

    Attributes:
        q: the coordinates, in the robot's order; None if it returns none.
        claim: whether it says that they solve the target; None if it does not say.
        time: what the adapter or its process has measured; None where the call is timed.
        error: what the solver raised, else "".
    """

    q: FloatArray | None
    claim: bool | None
    time: OwnTime | None = None
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


def needs_a_chain(robot: Robot) -> None:
    """Raise unless the robot is a chain of hinges with one effector.

    Raises:
        UnableError: if it is not.
    """
    if not robot.is_chain:
        raise UnableError("takes one chain of hinges only")


def pose_matrix(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return a pose as a matrix, (4, 4)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    return T


@contextlib.contextmanager
def robot_file(robot: Robot) -> Iterator[str]:
    """Yield the path of a file with the robot's text, for engines that read files only."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "robot.urdf" if robot.is_chain else "robot.xml")
        file.write_text(robot.text, encoding="utf-8")
        yield str(file)


def arrived(errors: Sequence[FloatArray], robot: Robot, tolerance: Tolerance) -> bool:
    """Return whether the effectors' errors, (6,) each, position first, are within the tolerance."""
    sizes = np.linalg.norm(np.reshape(errors, (-1, 2, 3)), axis=-1)
    limits = (tolerance.position, tolerance.rotation if robot.oriented else np.inf)
    return bool((sizes <= limits).all())


def iterate(step: Callable[[], object], is_done: Callable[[], bool], iterations: int) -> bool:
    """Step until that is done, so often at most; return whether it is."""
    for _ in range(iterations):
        if is_done():
            return True
        step()
    return is_done()
