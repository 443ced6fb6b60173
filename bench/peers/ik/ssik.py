"""ssik: closed forms for arms of six and seven hinges, in a module written by `ssik build`.

Its authors recommend the module for use, and the call for a single solution nearest to the start,
within the limits. Without the start, a single solution takes seconds on arms whose axes do not meet
(PR2). There is no tolerance: answers, checked by ssik's forward kinematics, are exact to rounding.
"""

import contextlib
import importlib.util
import io
import tempfile
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...problems.robots import UnableError
from ..peer import RESTARTS, Peer, Run
from ..protocol import (
    BenchRobot,
    FloatArray,
    Forward,
    PoseRequest,
    Solve,
    SolveFactory,
    Tolerance,
    describe,
)

PEER = Peer(
    "ssik",
    __name__,
    "ssik",
    "BSD-3-Clause",
    "closed forms, in a module built for an arm",
    "poses and limits of six or seven hinges, analytically; in a module that it builds for an arm",
    (Run(RESTARTS, note="nearest solution"),),
    use="exact, six or seven hinges",
)

# Arms whose modules take ssik more than seven minutes of processor time.
LONG_BUILDS = ("baxter", "tiago_pro")


def prepare(robot: BenchRobot, tolerance: Tolerance, solutions: int = 1) -> SolveFactory:
    """Return the solver, set up for a robot, which stops at so many solutions."""
    run = built_solver(robot).solve

    def make_solve(request: PoseRequest) -> Solve:
        options = {"max_solutions": solutions, "q_seed": request.start}
        return Solve(partial(run, request.matrix, **options), _read)

    return make_solve


def _read(solutions: list[Any]) -> tuple[FloatArray | None, bool]:
    return (solutions[0].q, True) if solutions else (None, False)


def prepare_all(robot: BenchRobot) -> SolveFactory:
    """Return the solver of all solutions, without copies by whole revolutions."""
    run = built_solver(robot).solve

    def make_solve(request: PoseRequest) -> Solve:
        return Solve(partial(run, request.matrix, enumerate_windings=False), read)

    def read(solutions: list[Any]) -> tuple[FloatArray, None]:
        rows = np.array([solution.q for solution in solutions])
        return rows.reshape(-1, len(robot.joints)), None

    return make_solve


def kinematics(robot: BenchRobot) -> Forward:
    """Return its forward kinematics of the effector."""
    return built_solver(robot).fk


def built_solver(robot: BenchRobot) -> ModuleType:
    """Return ssik's module for a robot.

    Raises:
        UnableError: if ssik builds no module.
    """
    robot.require_chain()
    if robot.name in LONG_BUILDS:
        raise UnableError("builds no solver for this arm within seven minutes")
    return _built(robot.text, robot.root, robot.effectors[0])


@cache  # a build takes up to minutes, and a second one in a process may fail
def _built(text: str, root: str, effector: str) -> ModuleType:
    from ssik import cli

    with tempfile.TemporaryDirectory() as folder:
        path, urdf = Path(folder, "arm_ik.py"), Path(folder, "robot.urdf")
        urdf.write_text(text, encoding="utf-8")
        command = ["build", str(urdf), "--base", root, "--ee", effector]
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
