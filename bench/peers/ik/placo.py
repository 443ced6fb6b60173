"""PlaCo: differential inverse kinematics by quadratic programs, iterated to a target.

Its wheels pin a Pinocchio older than ours, so PlaCo works in a process with an environment of its
own. The program, `placo_program`, measures its own time: the connection is not timed.
"""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.process.child import ChildProcess, LostError

from ...clock import is_metered, report_library
from ...problems.evaluate import evaluator_of
from ...problems.robot_tasks import (
    LOOK_AT,
    POSTURE,
    POSTURE_COST,
    RobotTask,
    TaskRequest,
    first_link,
    middle,
)
from ...problems.robots import UnableError
from ..packages import environment_python
from ..peer import ONE_START, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, OwnTime, SolveFactory, SolverOutput, Tolerance

# The search chose these on the tuning robots (docs/peers/index.md).
_SETTINGS = {"regularization": 1e-4, "weight": 0.3}
PEER = Peer(
    "PlaCo",
    __name__,
    "placo",
    "MIT",
    "differential inverse kinematics by quadratic programs",
    "poses and limits of one chain of hinges",
    (
        Run(ONE_START, {"iterations": 200, "regularization": 1e-3, "weight": 0.3}),
        short_attempts(_SETTINGS),
        restarted(25, _SETTINGS),
    ),
    environment="placo",
    built_on="Pinocchio",
    use="whole-body tasks",
)

METERED = True
PROGRAM = Path(__file__).parents[1] / "placo_program.py"


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 100,
    regularization: float = 1e-6,
    weight: float = 1.0,
) -> SolveFactory:
    """Return the solver, set up for a robot.

    Raises:
        UnableError: if the robot is no chain, or the program does not take it.
    """
    settings = {"iterations": iterations, "regularization": regularization, "weight": weight}
    answer = _program(robot, {"limits": tolerance, "parts": [{"kind": "pose"}]} | settings)
    return lambda request: answer(target=request.matrix.tolist(), start=request.start.tolist())


def prepare_task(
    robot: BenchRobot, task: RobotTask, tolerance: float, **settings: float
) -> Callable[[TaskRequest], Callable[[], SolverOutput]]:
    """Return the solver of a task, set up for an arm.

    Raises:
        UnableError: if PlaCo has no such task, or the program does not take the robot.
    """
    if any(part.kind == LOOK_AT for part in task.parts):
        raise UnableError("has no task to look at a point")
    bases = (robot.root, first_link(evaluator_of(robot.name)))
    posture = {"weight": POSTURE_COST**2, "middle": middle(robot).tolist()}
    parts = [
        dataclasses.asdict(part) | posture | {"base": bases[part.is_relative]}
        for part in task.parts
    ]
    goal = {"limits": [tolerance], "parts": parts}
    if any(part.kind == POSTURE for part in task.parts):  # which it would outweigh
        settings["regularization"] = POSTURE_COST**2
    answer = _program(robot, goal | settings)
    return lambda request: answer(goal=request.goal.tolist(), start=request.start.tolist())


def _program(robot: BenchRobot, goal: dict[str, Any]) -> Callable[..., Callable[[], SolverOutput]]:
    """Return a function that turns requests into calls of a program with a goal."""
    robot.require_chain()
    program = ChildProcess([environment_python("placo"), "-I", PROGRAM])
    chain = {"text": robot.text, "effector": robot.effectors[0], "joints": robot.joints}
    try:
        _answer(program, chain | goal | {"is_metered": is_metered()})
    except ConnectionError:
        why = "PlaCo does not read the robot, or orders its joints otherwise"
        raise UnableError(why) from None

    def make_solve(**request: Any) -> Callable[[], SolverOutput]:
        def solve() -> SolverOutput:
            claim, seconds, q, library_seconds = _answer(program, request)
            report_library(library_seconds)
            return SolverOutput(np.array(q), claim, OwnTime(float(seconds)))

        return solve

    return make_solve


def _answer(program: ChildProcess, request: object) -> Any:
    """Return the program's answer, or raise ConnectionError after its end."""
    try:
        program.send(f"{json.dumps(request)}\n".encode())
        return json.loads(program.receive())
    except LostError:
        raise ConnectionError("the program of PlaCo has ended") from None
