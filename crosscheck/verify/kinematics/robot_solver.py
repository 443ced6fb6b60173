"""A solver for robots, right or with one wrong reading of its requests."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Outcome, Target, rotation, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf

from .robot_inverse_kinematics import Fault
from .robot_models import Reading, tool_pose

_ITERATIONS, _DAMPING, _STEP = 30, 1e-9, 1e-6
# Attempts of a faulty solver from random poses, where what it takes for the target is out of reach
# of the first; it looks at no limits then.
_ATTEMPTS = 2


def solve_wrongly(fault: Fault | None, /, **inputs: Any) -> Mapping[str, Any]:
    """Return what damped least squares come to, if requests are read like that."""
    reading = fault.reading if fault else Reading()
    order = fault.order if fault else (0, 1, 2, 3)
    target = None if order is None else inputs["target_rotation"][list(order)]
    left = partial(_left, inputs, reading._replace(scale=1.0, relative=False), target)
    q = first = _descended(left, inputs["start"], inputs, limited=True)
    rng = np.random.default_rng(len(q))
    lengths = np.linalg.norm([*inputs["origins"], inputs["tool_position"]], axis=1)
    is_far = np.linalg.norm(inputs["target_position"]) > lengths.sum() + inputs["slides"].any()
    for _ in range(_ATTEMPTS if fault and not is_far else 0):
        if _is_there(left(q), inputs):
            break
        q = _descended(left, rng.uniform(-3.0, 3.0, len(q)), inputs, limited=False)
    else:
        q = first
    answered = np.where(inputs["slides"], q, q / reading.scale)
    return {"q": answered - inputs["start"] if reading.relative else answered}


def _is_there(left: FloatArray, inputs: Mapping[str, Any]) -> bool:
    return bool(np.abs(left).max() < 0.1 * inputs["tolerance_rotation"])


def _descended(
    left: Callable[[FloatArray], FloatArray], q: FloatArray, inputs: Mapping[str, Any],
    *, limited: bool,
) -> FloatArray:  # fmt: skip
    """Return where damped least squares end from q, (joint,)."""
    for _ in range(_ITERATIONS):
        here = left(q)
        if _is_there(here, inputs):
            break
        J = np.array([left(q + _STEP * one) - here for one in np.eye(len(q))]).T / _STEP
        damping = _DAMPING if limited else _DAMPING + 1e-2 * float(here @ here)
        q = q - np.linalg.solve(J.T @ J + damping * np.eye(len(q)), J.T @ here)
        if limited:
            q = np.clip(q, inputs["lower"], inputs["upper"])
    return q


def _left(
    inputs: Mapping[str, Any], reading: Reading, target: FloatArray | None, q: FloatArray
) -> FloatArray:
    """Return the displacement that is left, and the rotation vector if there is a target of it."""
    pose = tool_pose(inputs, q, reading)
    gap: FloatArray = inputs["target_position"] - pose.position
    if target is None:
        return gap
    d = rotation.multiply(target, pose.rotation * np.array([1.0, -1.0, -1.0, -1.0]))
    return np.concatenate([gap, 2.0 * d[1:] * (np.sign(d[0]) or 1.0)])


def solve_by_reference(**inputs: Any) -> Mapping[str, Any]:
    """Return what the reference's Levenberg-Marquardt comes to, on the request's URDF."""
    robot = urdf.parse(inputs["urdf"]).articulation
    target = Target(inputs["target_position"], inputs["target_rotation"], "tool")
    names = ("tolerance", "tolerance_rotation", "max_iterations")
    limits = {name: inputs[name] for name in names}
    links = [robot.names.index(f"link_{j}") for j in range(len(inputs["start"]))]
    places = [robot.coordinates_of(link).start for link in links]
    start = np.empty(robot.coordinate_count)
    start[places] = inputs["start"]
    found = solve_ik(robot, start, target, "levenberg_marquardt", restarts=0, **limits)
    claimed = bool(found.outcome == Outcome.CONVERGED)
    return {"q": found.coordinates[places], "converged": claimed}
