"""The interface of adapters for robots.

An adapter is a module with a function `prepare(robot, tolerance, **settings)`: it sets the engine
up for a robot and returns a function `ask(request)`. That puts a target in the engine's own types
and returns the call to be timed, which returns a `SolverOutput`: neither conversions nor set-up
count as time of a solve. For a robot that it cannot solve `prepare` raises `UnableError`.

If the engine's kinematics is compared as well, its adapter has a function `kinematics(robot)`,
which returns a `Forward`.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ...problems.evaluate import PoseRequest, Tolerance
from ...problems.robots import BenchRobot, UnableError
from ..protocol import OwnTime, describe

__all__ = ["BenchRobot", "FloatArray", "PoseRequest", "Tolerance", "UnableError"]


class SolverOutput(NamedTuple):
    """The answer of a solver."""

    q: FloatArray | None  # the coordinates, in the robot's order; None if it returns none
    claim: bool | None  # whether it says that they solve the target; None if it does not say
    # as the adapter or its process measured it; None where the call is timed
    time: OwnTime | None = None
    error: str = ""  # the exception of the solver, else ""


Solve = Callable[[], SolverOutput]
Ask = Callable[[PoseRequest], Solve]
# Coordinates to the effectors' positions [m], (effector, 3), and rotations, (effector, 3, 3).
Forward = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def attempt(solve: Solve) -> SolverOutput:
    """Return the answer of a solve; an exception is a failed attempt with its error."""
    try:
        return solve()
    except Exception as error:  # an exception of an engine is its result
        return SolverOutput(None, False, error=describe(error))


def arrived(errors: Sequence[FloatArray], robot: BenchRobot, tolerance: Tolerance) -> bool:
    """Return whether the effectors' errors, (6,) each, position first, are within the tolerance."""
    sizes = np.linalg.norm(np.reshape(errors, (-1, 2, 3)), axis=-1)
    limits = (tolerance.position, tolerance.rotation if robot.oriented else np.inf)
    return bool((sizes <= limits).all())


def iterate(step: Callable[[], object], is_done: Callable[[], bool], iterations: int) -> bool:
    """Step until `is_done`, at most so often; return whether it is."""
    for _ in range(iterations):
        if is_done():
            return True
        step()
    return is_done()
