"""PlaCo: differential inverse kinematics by quadratic programs, iterated to a target.

Its wheels pin a Pinocchio older than ours, so it works in a process of an environment of its own,
`placo_program`, which measures its own time: the connection is not timed.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.crosscheck.child_process import ChildProcess, LostError

from ...problems.robots import UnableError
from ..protocol import OwnTime
from ..registry import environment_python
from .overhead import is_metered, report_library
from .protocol import Ask, BenchRobot, PoseRequest, SolverOutput, Tolerance

METERED = True
PROGRAM = Path(__file__).with_name("placo_program.py")


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 100,
    regularization: float = 1e-6,
    weight: float = 1.0,
) -> Ask:
    """Return the solver, set up for a robot.

    Raises:
        UnableError: if the robot is no chain, or the program does not take it.
    """
    robot.require_chain()
    program = ChildProcess([environment_python("placo"), "-I", PROGRAM])
    task = {
        "text": robot.text,
        "effector": robot.effectors[0],
        "joints": robot.joints,
        "regularization": regularization,
        "weight": weight,
        "is_metered": is_metered(),
        "iterations": iterations,
        "limits": tolerance,
    }
    try:
        _answer(program, task)
    except ConnectionError:
        why = "PlaCo does not read the robot, or orders its joints otherwise"
        raise UnableError(why) from None

    def ask(request: PoseRequest) -> Callable[[], SolverOutput]:
        question = {"target": request.matrix.tolist(), "start": request.start.tolist()}

        def solve() -> SolverOutput:
            claim, seconds, q, library_seconds = _answer(program, question)
            report_library(library_seconds)
            return SolverOutput(np.array(q), claim, OwnTime(float(seconds)))

        return solve

    return ask


def _answer(program: ChildProcess, question: object) -> Any:
    """Return the program's answer, or raise ConnectionError if it has ended."""
    try:
        program.send(f"{json.dumps(question)}\n".encode())
        return json.loads(program.receive())
    except LostError:
        raise ConnectionError("the program of PlaCo has ended") from None
