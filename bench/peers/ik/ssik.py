"""ssik: closed forms for arms of six and seven hinges, in a module that `ssik build` writes.

Its authors recommend that module for use, and the call for one solution nearest to the start,
within the limits. Without the start, a single solution takes seconds on arms whose axes do not meet
(PR2). It takes no tolerance: its answers, checked by its forward kinematics, are exact to rounding.
"""

import contextlib
import importlib.util
import io
import tempfile
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from ssik import cli

from ...problems.robots import UnableError
from ..protocol import describe
from .protocol import (
    Ask,
    BenchRobot,
    FloatArray,
    Forward,
    PoseRequest,
    Solve,
    Tolerance,
    forward_by,
)


def prepare(robot: BenchRobot, tolerance: Tolerance, solutions: int = 1) -> Ask:
    """Return the solver, set up for a robot, which stops at so many solutions."""
    run = built_solver(robot).solve

    def ask(request: PoseRequest) -> Solve:
        options = {"max_solutions": solutions, "q_seed": request.start}
        return Solve(partial(run, request.matrix, **options), _read)

    return ask


def _read(solutions: list[Any]) -> tuple[FloatArray | None, bool]:
    return (solutions[0].q, True) if solutions else (None, False)


def kinematics(robot: BenchRobot) -> Forward:
    """Return its forward kinematics of the effector."""
    return forward_by(built_solver(robot).fk)


def built_solver(robot: BenchRobot) -> ModuleType:
    """Return the module that it builds for a robot.

    Raises:
        UnableError: if it builds none.
    """
    robot.require_chain()
    with tempfile.TemporaryDirectory() as folder, robot.file() as urdf:
        path = Path(folder, "arm_ik.py")
        command = ["build", urdf, "--base", robot.root, "--ee", robot.effectors[0]]
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                cli.main([*command, "--no-validate", "--out", str(path)])
            return _imported(path)
        except (OSError, RuntimeError, ValueError) as error:
            raise UnableError(f"builds no solver for this arm: {describe(error)}") from None


def _imported(path: Path) -> ModuleType:
    spec: Any = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
