"""Plumbob's own solvers, through their public interface, on the model made by its readers."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import (
    IKSolution,
    Outcome,
    Target,
    all_solutions,
    prepare_all_solutions,
    prepare_ik,
    prepare_tasks,
    rotation,
    solve_ik,
    solve_tasks,
    tasks,
)
from plumbob.reference.formats import mjcf, urdf
from plumbob.reference.inverse_kinematics.solve_tasks import TaskSolution
from plumbob.reference.model import Robot

from ...problems.evaluate import evaluator_of
from ...problems.robot_tasks import (
    POSTURE_COST,
    RobotTask,
    TaskPart,
    TaskRequest,
    first_link,
    middle,
)
from ..peer import ONE_START, PORTFOLIO, RESTARTS, Peer, Run
from ..protocol import BenchRobot, FloatArray, PoseRequest, Solve, SolveFactory, Tolerance

# The search found that more iterations and restarts gain nothing (docs/peers/index.md).
_LM = {"solver": "levenberg_marquardt", "iterations": 100}
_FIRST_PHASE = {**_LM, "restarts": 0, "phases": 1}
PEER = Peer(
    "Plumbob LM",
    __name__,
    "plumbob",
    "MIT",
    "Levenberg-Marquardt within limits, in phases",
    "poses, positions and limits of several effectors, balls",
    (
        Run(ONE_START, _FIRST_PHASE, "first phase"),
        Run(PORTFOLIO, {**_LM, "restarts": 0, "phases": 8}, "eight phases"),
        Run(RESTARTS, {**_LM, "restarts": 14}, "14 restarts"),
        # The cost of a call without preparation.
        Run(ONE_START, {**_FIRST_PHASE, "prepared": False}, "first phase, plain call"),
        Run(RESTARTS, {**_LM, "restarts": 14, "prepared": False}, "14 restarts, plain call"),
    ),
    use="many solves from Python",
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    solver: str = "levenberg_marquardt",
    restarts: int = 0,
    iterations: int = 200,
    phases: int | None = None,
    prepared: bool = True,
) -> SolveFactory:
    """Return the solver, set up for a robot; `prepare_ik` takes a single effector."""
    read = urdf.parse if robot.is_chain else mjcf.parse
    articulation = read(robot.text).articulation
    settings: dict[str, Any] = {"solver": solver, "restarts": restarts, "phases": phases}
    settings |= {"max_iterations": iterations, "tolerance": tolerance.position}
    settings |= {"tolerance_rotation": tolerance.rotation}
    if prepared and robot.is_chain:
        solve = prepare_ik(articulation, effector=robot.effectors[0], oriented=True, **settings)

        def ask_prepared(request: PoseRequest) -> Solve:
            target = np.append(request.positions[0], rotation.from_matrix(request.rotations[0]))
            return Solve(partial(solve, request.start, target), partial(_read_prepared, solve))

        return ask_prepared

    def make_solve(request: PoseRequest) -> Solve:
        x, R, start = request
        quaternions = rotation.from_matrix(R) if robot.oriented else [None] * len(x)
        targets = [*map(Target, x, quaternions, robot.effectors)]
        return Solve(partial(solve_ik, articulation, start, targets, **settings), _read)

    return make_solve


def prepare_all(robot: BenchRobot, prepared: bool = True) -> SolveFactory:
    """Return the solver of all solutions, set up for a chain."""
    articulation = urdf.parse(robot.text).articulation
    solve = prepare_all_solutions(articulation)

    def make_solve(request: PoseRequest) -> Solve:
        x, Q = request.positions[0], rotation.from_matrix(request.rotations[0])
        call = partial(solve, np.append(x, Q))
        if not prepared:
            call = partial(all_solutions, articulation, Target(x, Q))
        return Solve(call, lambda s: (s.coordinates.copy(), None))

    return make_solve


def _read(solution: IKSolution | TaskSolution) -> tuple[FloatArray | None, bool]:
    return solution.coordinates, solution.outcome == Outcome.CONVERGED


def _read_prepared(solve: Any, outcome: Outcome) -> tuple[FloatArray, bool]:
    return solve.coordinates.copy(), outcome == Outcome.CONVERGED


def prepare_task(
    robot: BenchRobot, task: RobotTask, tolerance: float, prepared: bool = True, **settings: Any
) -> Callable[[TaskRequest], Solve]:
    """Return the solver of a task, set up for an arm, with settings of `prepare_tasks`."""
    arm, base = urdf.parse(robot.text), first_link(evaluator_of(robot.name))
    # of an entry of a residual, so that its three keep it together
    settings["tolerance"] = tolerance / 3.0**0.5

    def make_solve(request: TaskRequest) -> Solve:
        goal = tasks.configuration(arm.articulation, request.goal)
        parts = [_task(robot, part, arm, goal, base) for part in task.parts]
        if not prepared:
            call = partial(solve_tasks, arm.articulation, request.start, parts, **settings)
            return Solve(call, _read)
        solve = prepare_tasks(arm.articulation, parts, **settings)
        return Solve(partial(solve, request.start), partial(_read_prepared, solve))

    return make_solve


def _task(
    robot: BenchRobot, part: TaskPart, arm: Robot, goal: tasks.Configuration, base: str
) -> tasks.IKTask:
    """Return a part of a task as met by a configuration of the goal."""
    effector = robot.effectors[0]
    frame, reference = goal.frame(effector), goal.frame(base if part.is_relative else None)
    match part.kind:
        case "posture":
            return tasks.Posture(middle(robot), weight=POSTURE_COST**2)
        case "look_at":
            return tasks.LookAt(effector, frame.position + frame.matrix[:, 2])
        case "centre_of_mass":  # of what moves, as the peers have it
            moving = np.logical_or.accumulate(np.array(arm.articulation.kinds) != "fixed")
            balance = tasks.CentreOfMass(arm.masses * moving, arm.centres, (0.0, 0.0, 0.0))
            return replace(balance, position=balance.evaluate(goal)[0])
    into = reference.matrix.T
    x, R = into @ (frame.position - reference.position), rotation.from_matrix(into @ frame.matrix)
    relative = base if part.is_relative else None
    return tasks.FrameTask(effector, x, R, relative_to=relative, axes=part.axes)
