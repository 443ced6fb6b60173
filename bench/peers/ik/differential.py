"""Differential inverse kinematics by quadratic programs, as mink and pink have it alike."""

from collections.abc import Callable, Sequence
from math import hypot
from typing import Any

from .overhead import library
from .protocol import BenchRobot, FloatArray, Tolerance


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
