"""Differential inverse kinematics by quadratic programs, as mink and pink have it alike."""

from collections.abc import Callable, Sequence
from functools import partial
from math import hypot
from typing import Any

import numpy as np

from ...problems.robot_tasks import POSTURE, RobotTask, TaskRequest, middle
from .overhead import library
from .protocol import BenchRobot, FloatArray, Solve, Tolerance

# Where a posture counts, iterations go on until a step is smaller than this [rad].
SETTLED_STEP = 1e-3


def reaching(
    solve_ik: Callable[..., Any],
    configuration: Any,
    tasks: Sequence[Any],
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int,
    **options: Any,
) -> Callable[[Sequence[Any], FloatArray], bool]:
    """Return a function that steps to targets, one for each task, from coordinates.

    It makes so many steps at the most, and returns whether the effectors have arrived.
    """
    solve, integrate = library(solve_ik), library(configuration.integrate_inplace)
    compute_errors = [library(task.compute_error) for task in tasks]
    setters, update = [library(task.set_target) for task in tasks], library(configuration.update)

    def reach(targets: Sequence[Any], start: FloatArray) -> bool:
        for set_target, target in zip(setters, targets, strict=True):
            set_target(target)
        update(start)
        for _ in range(iterations):
            if is_done():
                return True
            integrate(solve(configuration, tasks, 1.0, solver="daqp", **options), 1.0)
        return is_done()

    def is_done() -> bool:
        errors = [compute(configuration).tolist() for compute in compute_errors]
        return all(
            hypot(x, y, z) <= tolerance.position
            and not (robot.oriented and hypot(*rotation_vector) > tolerance.rotation)
            for x, y, z, *rotation_vector in errors
        )

    return reach


def meeting(
    solve_ik: Callable[..., Any],
    configuration: Any,
    parts: Sequence[Any],
    robot: BenchRobot,
    task: RobotTask,
    tolerance: float,
    iterations: int,
    **options: Any,
) -> Callable[[TaskRequest], Solve]:
    """Return the solver of a task, whose parts are tasks of the library in the same order.

    It steps to what the goal's configuration has; a posture is approached only.
    """
    exact = [
        (part.compute_error, np.asarray(part.cost) > 0.0)
        for part, row in zip(parts, task.parts, strict=True)
        if row.kind != POSTURE
    ]
    has_posture = len(exact) < len(parts)

    def meet(start: FloatArray) -> bool:
        configuration.update(start)
        largest = np.inf if has_posture else 0.0
        for _ in range(iterations):
            if largest <= SETTLED_STEP and is_met():
                return True
            velocity = solve_ik(configuration, parts, 1.0, solver="daqp", **options)
            configuration.integrate_inplace(velocity, 1.0)
            largest = np.abs(velocity).max() if has_posture else 0.0
        return is_met()

    def is_met() -> bool:
        errors = (counts * compute_error(configuration) for compute_error, counts in exact)
        return all(hypot(*e[:3]) <= tolerance and hypot(*e[3:]) <= tolerance for e in errors)

    def ask(request: TaskRequest) -> Solve:
        configuration.update(request.goal)
        for part in parts:
            part.set_target_from_configuration(configuration)
        if has_posture:
            parts[-1].set_target(middle(robot))
        return Solve(partial(meet, request.start), lambda claim: (configuration.q.copy(), claim))

    return ask
