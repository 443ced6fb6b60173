"""Differential inverse kinematics by quadratic programs, as in both mink and pink."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import hypot
from typing import Any

import numpy as np

from plumbob.reference.inverse_kinematics.reduce import further_shares
from plumbob.reference.inverse_kinematics.restarts import (
    MORE_PATIENT,
    PATIENCE_OF_PHASES,
    PROGRESS,
)

from ..clock import library
from ..problems.robot_tasks import POSTURE, RobotTask, TaskRequest, middle
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
    """Return a function to step from coordinates to targets, a target for each task.

    The function makes so many steps at the most, and returns whether the effectors have arrived.
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


@dataclass(eq=False)
class PhaseAttempt:
    """An attempt from one of several starts."""

    q: Any  # where it is, in the library's coordinates
    patience: float = PATIENCE_OF_PHASES  # steps without progress after which it is given up
    error: float = 0.0  # in units of the library's task, whose costs are 1; 0 before it begins


class PhasedReach:
    """A library's task loop in the phases of our Levenberg-Marquardt, see `restarts.py`.

    A phase is the library's plain loop from the start, or from one of our further starts. An
    exception ends its phase only, as in restarts.
    """

    def __init__(
        self,
        solve_ik: Callable[..., Any],
        configuration: Any,
        task: Any,
        goal: tuple[BenchRobot, Tolerance, int],
        further_starts: Iterable[FloatArray],
        **options: Any,
    ) -> None:
        """Take the task of the only effector; the goal ends with the number of iterations."""
        robot, self.tolerance, self.iterations = goal
        robot.require_chain()
        self.task, self.configuration = task, configuration
        self.further_starts = tuple(further_starts)
        self.solve = partial(library(solve_ik), configuration, solver="daqp", **options)
        self.integrate = library(configuration.integrate_inplace)
        self.compute_error = library(task.compute_error)

    def __call__(self, targets: Sequence[Any], start: FloatArray) -> bool:
        """Step from the starts to the only target; return whether the effector arrives.

        Raises:
            Exception: the first of the library, if the effector arrives in no phase.
        """
        self.task.set_target(*targets)
        attempts = [PhaseAttempt(q) for q in (start, *self.further_starts)]
        self.steps_left, exceptions = self.iterations, list[Exception]()
        while attempts and self.steps_left > 0:
            attempt = min(attempts, key=lambda a: (a.patience, a.error))
            try:
                self.go_on(attempt)
            except Exception as exception:
                attempts.remove(attempt)
                exceptions.append(exception)
            else:
                if attempt.error == 0.0:
                    return True
        if exceptions:
            raise exceptions[0]
        return False

    def go_on(self, attempt: PhaseAttempt) -> None:
        """Step until the target is reached, where the error is 0, or progress or steps end."""
        self.configuration.update(attempt.q)
        milestone, since = np.inf, 0
        while True:
            e, limits = self.compute_error(self.configuration), self.tolerance
            is_reached = hypot(*e[:3]) <= limits.position and hypot(*e[3:]) <= limits.rotation
            attempt.error = 0.0 if is_reached else hypot(*e)
            since += 1
            if attempt.error < PROGRESS * milestone:
                milestone, since = attempt.error, 0
            if is_reached or since >= attempt.patience or self.steps_left == 0:
                break
            self.steps_left -= 1
            self.integrate(self.solve([self.task], 1.0), 1.0)
        attempt.q, attempt.patience = self.configuration.q.copy(), MORE_PATIENT * attempt.patience


def further_starts(robot: BenchRobot, phases: int) -> FloatArray:
    """Return our further starts, (phase - 1, coordinate)."""
    shares = further_shares(len(robot.lower))[: phases - 1]
    return robot.lower + shares * (robot.upper - robot.lower)


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

    The targets are the parts of the goal's configuration; a posture is approached only.
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

    def make_solve(request: TaskRequest) -> Solve:
        configuration.update(request.goal)
        for part in parts:
            part.set_target_from_configuration(configuration)
        if has_posture:
            parts[-1].set_target(middle(robot))
        return Solve(partial(meet, request.start), lambda claim: (configuration.q.copy(), claim))

    return make_solve
