"""tinyik: SciPy's minimisation of the squared distance of a position, with numerical derivatives.

Its links are translations and its hinges turn about x, y or z, so it takes arms whose axes at zero
are parallel to the root's. It reaches positions only and does not say whether it did.
"""

from functools import partial
from typing import Any

import numpy as np
import tinyik

from ...problems.robots import UnableError
from .axes import axes_at_zero
from .protocol import Ask, BenchRobot, FloatArray, PoseRequest, Solve, Tolerance

# An axis counts as parallel to x, y or z up to this [rad].
PARALLEL = 1e-9


def prepare(
    robot: BenchRobot, tolerance: Tolerance, method: str = "L-BFGS-B", iterations: int = 50
) -> Ask:
    """Return the solver, set up for a robot, with a method of SciPy that takes bounds.

    Raises:
        UnableError: for targets with a rotation, and for oblique hinges.
    """
    robot.require_chain()
    if robot.oriented:
        raise UnableError("reaches positions only, and the targets are poses")
    tokens, signs = _actuator(robot)
    options: dict[str, Any] = {"method": method, "options": {"maxiter": iterations}}
    limits = np.sort(np.stack([signs * robot.lower, signs * robot.upper], axis=-1), axis=-1)
    optimizer = tinyik.ScipyOptimizer(**options, bounds=limits.tolist())
    run = tinyik.Actuator(tokens, optimizer).ik.solve

    def ask(request: PoseRequest) -> Solve:
        solve = partial(run, signs * request.start, request.positions[0])
        return Solve(solve, lambda angles: (signs * angles, None))

    return ask


def _actuator(robot: BenchRobot) -> tuple[list[Any], FloatArray]:
    """Return the links and hinges in tinyik's terms, and the signs of its angles."""
    axes, offsets, _ = axes_at_zero(robot)
    directions = np.abs(axes).argmax(axis=-1)
    signs = np.sign(np.take_along_axis(axes, directions[:, None], axis=-1)[:, 0])
    if np.abs(axes - signs[:, None] * np.eye(3)[directions]).max() > PARALLEL:
        raise UnableError("takes hinges about x, y or z only")
    tokens: list[Any] = []
    for offset, direction in zip(offsets, directions, strict=False):
        tokens += [offset.tolist(), "xyz"[direction]]
    return [*tokens, offsets[-1].tolist()], signs
