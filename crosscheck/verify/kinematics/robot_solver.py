"""Solvers for robots, right or with a misreading of their requests, for the self-test."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from plumbob.reference import Outcome, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf

from ..sentence import sentence
from .robot_inverse_kinematics import Misreading
from .robot_models import mechanism, target_of

RIGHT = Misreading(sentence(""))
# Restarts of a faulty solver without limits, whose own target the first solve has not reached.
RESTARTS = 2
LIMITS = ("tolerance", "tolerance_rotation", "max_iterations")


def solve_wrongly(fault: Misreading | None, /, **inputs: Any) -> Mapping[str, Any]:
    """Return the result of damped least squares on a misread request."""
    fault = fault or RIGHT
    request = fault.read(inputs)
    q, reached = _solve(request, 0)
    if fault is not RIGHT and not reached:
        infinite = np.full(len(q), np.inf)
        free, reached = _solve({**request, "lower": -infinite, "upper": infinite}, RESTARTS)
        q = free if reached else q
    return {"q": fault.answer(inputs, q)}


def _solve(request: Mapping[str, Any], restarts: int) -> tuple[FloatArray, bool]:
    """Return coordinates, and whether they reach the target."""
    solution = solve_ik(
        mechanism(request), request["start"], target_of(request), "damped_least_squares",
        restarts=restarts, **{name: request[name] for name in LIMITS},
    )  # fmt: skip
    return solution.coordinates, bool(solution.outcome == Outcome.CONVERGED)


def solve_by_reference(**inputs: Any) -> Mapping[str, Any]:
    """Return the result of the reference's Levenberg-Marquardt on the request's URDF."""
    robot = urdf.parse(inputs["urdf"]).articulation
    links = [robot.names.index(f"link_{joint}") for joint in range(len(inputs["start"]))]
    coordinates = [robot.coordinates_of(link).start for link in links]
    start = np.empty(robot.coordinate_count)
    start[coordinates] = inputs["start"]
    target = target_of(inputs)._replace(effector="tool")
    options = {name: inputs[name] for name in LIMITS}
    solution = solve_ik(robot, start, target, "levenberg_marquardt", restarts=0, **options)
    converged = bool(solution.outcome == Outcome.CONVERGED)
    return {"q": solution.coordinates[coordinates], "converged": converged}
