"""Differential inverse kinematics by quadratic programs, as in both mink and pink."""

from collections.abc import Callable, Sequence
from functools import partial
from math import hypot
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.inverse_kinematics.jacobian import LEANING, PHASES
from plumbob.reference.inverse_kinematics.restarts import (
    FIRST_PATIENCE,
    FURTHER_PATIENCE,
    PROGRESS,
)

from ..clock import library
from ..problems.robot_tasks import POSTURE, RobotTask, TaskRequest, middle
from .protocol import BenchRobot, FloatArray, Solve, Tolerance

# Where a posture counts, iterations go on until a step is smaller than this [rad].
SETTLED_STEP = 1e-3
# The rotation that stands for the long way round: libraries take the shortest way [rad].
LONG_WAY = np.pi - 1e-3


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


class PhasedReach:
    """A library's task loop in the phases of our Levenberg-Marquardt, see `solve_ik`.

    The first phase is the library's plain loop. Each further phase damps by a share of the squared
    error, and turns the effector the long way round at first. A posture task for mid-range of the
    same weight replaces the damping: a step damped about mid-range.
    """

    def __init__(
        self,
        solve_ik: Callable[..., Any],
        configuration: Any,
        tasks: tuple[Any, Any],
        rotated: Callable[[Any, FloatArray], Any],
        goal: tuple[BenchRobot, Tolerance, int, int],
        **options: Any,
    ) -> None:
        """Take tasks of the effector and of the posture, and a function to rotate a target.

        The goal ends with the number of iterations and of phases.
        """
        robot, self.tolerance, self.iterations, self.phases = goal
        robot.require_chain()
        self.task, self.posture = tasks
        self.configuration, self.rotated = configuration, rotated
        self.solve = partial(library(solve_ik), configuration, solver="daqp", **options)
        self.integrate = library(configuration.integrate_inplace)
        self.compute_error = library(self.task.compute_error)
        self.damping = self.task.lm_damping
        self.posture.set_target(middle(robot))

    def __call__(self, targets: Sequence[Any], start: FloatArray) -> bool:
        """Step from a start to the only target; return whether the effector arrives."""
        (self.target,) = targets
        ends: list[tuple[float, int, FloatArray]] = []
        count = self.iterations
        for phase in range(self.phases):
            patience = FURTHER_PATIENCE if phase else FIRST_PATIENCE
            self.configuration.update(start)
            error, steps = self.attempt(phase, 0, count, patience)
            if error == 0.0:
                return True
            ends.append((error, phase, self.configuration.q.copy()))
            count -= steps
        _, phase, q = min(ends, key=lambda end: end[0])
        self.configuration.update(q)
        return self.attempt(phase, LEANING, count, np.inf)[0] == 0.0

    def attempt(self, phase: int, begin: int, count: int, patience: float) -> tuple[float, int]:
        """Step until the target is reached or progress ends; return the error, 0 there, and steps.

        The error is in units of the library's task, whose costs are 1.
        """
        milestone, since = np.inf, 0
        for k in range(count + 1):
            self.task.set_target(self.target)
            e = self.compute_error(self.configuration)
            error, limits = hypot(*e), self.tolerance
            if hypot(*e[:3]) <= limits.position and hypot(*e[3:]) <= limits.rotation:
                return 0.0, k
            since += 1
            if error < PROGRESS * milestone:
                milestone, since = error, 0
            if k == count or since >= patience:
                break
            self.step(phase, begin + k, e)
        return error, k

    def step(self, phase: int, iteration: int, e: FloatArray) -> None:
        """Make a step of a phase from an error."""
        tasks, self.task.lm_damping = [self.task], self.damping
        if phase:
            share, turns = PHASES[phase - 1]
            if iteration < turns:
                self.task.set_target(self.rotated(self.target, long_way(e[3:])))
                e = self.compute_error(self.configuration)
            self.task.lm_damping = 0.0 if iteration < LEANING else share
            if iteration < LEANING:
                self.posture.cost[...] = np.sqrt(share * e @ e)
                tasks.append(self.posture)
        self.integrate(self.solve(tasks, 1.0), 1.0)


def long_way(error: FloatArray) -> FloatArray:
    """Return the matrix that rotates a target so the way there is about the opposite axis.

    The error is the rotation vector from the effector to the target [rad].
    """
    angle = max(hypot(*error), 1e-12)
    return rotation.to_matrix(rotation.exponential(-error * (1.0 + LONG_WAY / angle)))


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
