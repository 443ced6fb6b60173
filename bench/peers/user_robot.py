"""A user's solver for robots: hinges in a row, a tool, poses within limits."""

from collections.abc import Callable
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.verify.kinematics import robot_models

from ..problems.robots import links
from .connection import connection
from .protocol import (
    BenchRobot,
    NoAnswerError,
    PoseRequest,
    SolveFactory,
    SolverOutput,
    Tolerance,
    UnableError,
)
from .user_solver import ROBOT_TASK, Spec

# Twice the default of `solve_ik`: a count of iterations is each solver's own.
ITERATIONS = 200


def prepare(robot: BenchRobot, tolerance: Tolerance, spec: Spec = "") -> SolveFactory:
    """Return a user's solver, set up for a robot.

    Raises:
        UnableError: for a robot that the protocol cannot describe.
    """
    if not robot.is_chain:
        raise UnableError("not asked: the protocol has hinges and one effector, no balls")
    solver, inputs = connection(spec), robot_inputs(robot)
    inputs |= {"tolerance": tolerance.position, "tolerance_rotation": tolerance.rotation}

    def make_solve(request: PoseRequest) -> Callable[[], SolverOutput]:
        target = {"target_position": request.positions[0], "start": request.start}
        target["target_rotation"] = rotation.from_matrix(request.rotations[0])

        def solve() -> SolverOutput:
            answer, time = solver.answer(ROBOT_TASK, {**inputs, **target})
            if "q" not in answer:
                raise NoAnswerError("It answered no q.")
            return SolverOutput(answer["q"], answer.get("converged"), time)

        return solve

    return make_solve


def robot_inputs(robot: BenchRobot) -> dict[str, Any]:
    """Return a chain of hinges in the terms of the protocol; its frames hold the fixed joints."""
    transform, frames, axes = np.eye(4), [], []
    for link in links(robot):
        transform = transform @ link.transform
        if link.axis is not None:
            frames.append(transform)
            axes.append(link.axis)
            transform = np.eye(4)
    count, origins = len(frames), np.array(frames)
    inputs = {
        "parents": np.arange(count) - 1,
        "origins": origins[:, :3, 3],
        "orientations": rotation.from_matrix(origins[:, :3, :3]),
        "axes": np.array(axes),
        "slides": np.zeros(count, dtype=bool),
        "lower": robot.lower,
        "upper": robot.upper,
        "effector": count - 1,
        "tool_position": transform[:3, 3],
        "tool_rotation": rotation.from_matrix(transform[:3, :3]),
        "max_iterations": ITERATIONS,
    }
    return inputs | {"urdf": robot_models.urdf(inputs)}
