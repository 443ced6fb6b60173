"""Solvers for robots, right or with one wrong reading of their requests, for the self-test."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from plumbob.reference import Outcome, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf

from ..sentence import sentence
from .robot_inverse_kinematics import Fault
from .robot_models import mechanism, target_of

RIGHT = Fault(sentence(""))
# Restarts of a faulty solver without limits, where what it takes for the target is out of reach
# of the first solve.
RESTARTS = 2


def solve_wrongly(fault: Fault | None, /, **inputs: Any) -> Mapping[str, Any]:
    """Return what damped least squares come to, if requests are read like that."""
    fault = fault or RIGHT
    request = fault.read(inputs)
    q, reached = _solved(request, 0)
    if fault is not RIGHT and not reached:
        endless = np.full(len(q), np.inf)
        free, reached = _solved({**request, "lower": -endless, "upper": endless}, RESTARTS)
        q = free if reached else q
    return {"q": fault.answered(inputs, q)}


def _solved(request: Mapping[str, Any], restarts: int) -> tuple[FloatArray, bool]:
    """Return coordinates, and whether they reach the target."""
    tolerances = {name: request[name] for name in ("tolerance", "tolerance_rotation")}
    solution = solve_ik(
        mechanism(request), request["start"], target_of(request), "damped_least_squares",
        restarts=restarts, max_iterations=request["max_iterations"], **tolerances,
    )  # fmt: skip
    return solution.coordinates, bool(solution.outcome == Outcome.CONVERGED)


def solve_by_reference(**inputs: Any) -> Mapping[str, Any]:
    """Return what the reference's Levenberg-Marquardt comes to, on the request's URDF."""
    robot = urdf.parse(inputs["urdf"]).articulation
    names = ("tolerance", "tolerance_rotation", "max_iterations")
    options = {name: inputs[name] for name in names}
    links = [robot.names.index(f"link_{j}") for j in range(len(inputs["start"]))]
    places = [robot.coordinates_of(link).start for link in links]
    start = np.empty(robot.coordinate_count)
    start[places] = inputs["start"]
    target = target_of(inputs)._replace(effector="tool")
    solution = solve_ik(robot, start, target, "levenberg_marquardt", restarts=0, **options)
    converged = bool(solution.outcome == Outcome.CONVERGED)
    return {"q": solution.coordinates[places], "converged": converged}
