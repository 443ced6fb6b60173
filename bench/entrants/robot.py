"""An entrant as a solver for robots: hinges in a row, a tool, poses within limits."""

from typing import Any

import numpy as np

from plumbob.crosscheck.verify.kinematics import robot_models
from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

from ..experiments.robots.evaluate import Tolerance
from ..experiments.robots.problem import Robot, links
from ..harness.worker import NoAnswerError
from ..peers.ik.protocol import Solve, SolverOutput, UnableError
from .contestants import asked, remark
from .entrant import Spec

__all__ = ["TASK", "prepare", "remark", "robot_inputs"]

TASK = "robot_inverse_kinematics"
ITERATIONS = 200


def prepare(robot: Robot, tolerance: Tolerance, spec: Spec = "") -> Any:
    """Return an entrant, set up for a robot.

    Raises:
        UnableError: for a robot that the protocol has no words for.
    """
    if not robot.is_chain:
        raise UnableError("not asked: the protocol has hinges and one effector, no balls")
    solver, known = asked(spec), robot_inputs(robot)
    known |= {"tolerance": tolerance.position, "tolerance_rotation": tolerance.rotation}

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        inputs = {
            **known,
            "start": start,
            "target_position": positions[0],
            "target_rotation": rotation.from_matrix(rotations[0]),
        }

        def solve() -> SolverOutput:
            values = solver.answer(TASK, inputs).values
            if "q" not in values:
                raise NoAnswerError("It answered no q.")
            return SolverOutput(values["q"], values.get("converged"))

        return solve

    return ask


def robot_inputs(robot: Robot) -> dict[str, Any]:
    """Return what the protocol says of a chain of hinges; its frames hold the fixed joints."""
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
