"""Tasks of arms beyond the pose of the effector (`robot_tasks.toml`), evaluated by MuJoCo."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import scipy

from plumbob.reference.arguments import FloatArray

from .evaluate import Evaluator
from .robots import LIMIT_TOLERANCE, BenchRobot

FRAME, LOOK_AT, CENTRE_OF_MASS, POSTURE = "frame", "look_at", "centre_of_mass", "posture"
# The root of a posture's weight, the cost in mink's and pink's own examples.
POSTURE_COST = 1e-3


@dataclass(frozen=True)
class TaskPart:
    """A part of a task; see the file."""

    kind: str
    axes: tuple[float, ...] = ()
    is_relative: bool = False


@dataclass(frozen=True)
class RobotTask:
    """A task."""

    title: str  # how it is written
    parts: tuple[TaskPart, ...]


class TaskRequest(NamedTuple):
    """A goal, as the coordinates of a configuration at the goal, and a start, (coordinate,)."""

    goal: FloatArray
    start: FloatArray


ROBOT_TASKS = msgspec.toml.decode(
    Path(__file__).with_suffix(".toml").read_bytes(), type=dict[str, RobotTask]
)


def middle(robot: BenchRobot) -> FloatArray:
    """Return the coordinates in the middle of the limits, (coordinate,)."""
    return 0.5 * (robot.lower + robot.upper)


def first_link(evaluator: Evaluator) -> str:
    """Return the first moving link."""
    return str(evaluator.model.body(evaluator.model.jnt_bodyid[0]).name)


def is_met(
    evaluator: Evaluator, task: RobotTask, request: TaskRequest, q: FloatArray, tolerance: float
) -> bool:
    """Return whether coordinates meet all parts of a task but the posture, within the limits."""
    robot, model = evaluator.robot, evaluator.model
    excess = np.maximum(robot.lower - q, q - robot.upper).max()
    actual, target = _data(model, q), _data(model, request.goal)
    effector, base = model.body(robot.effectors[0]).id, model.body(first_link(evaluator)).id
    misses = [_misses(part, actual, target, effector, base) for part in task.parts]
    return bool(excess <= LIMIT_TOLERANCE and max(map(max, misses)) <= tolerance)


def _misses(part: TaskPart, actual: Any, target: Any, effector: int, base: int) -> list[float]:
    """Return by what distance [m] and angle [rad] a part of a task is missed."""
    if part.kind == POSTURE:
        return [0.0]
    if part.kind == CENTRE_OF_MASS:
        return [float(np.linalg.norm(actual.subtree_com[1] - target.subtree_com[1]))]
    reference = base if part.is_relative else 0
    x, R = _relative(actual, effector, reference)
    x_goal, R_goal = _relative(target, effector, reference)
    if part.kind == LOOK_AT:
        direction = x_goal + R_goal[:, 2] - x
        return [float(np.linalg.norm(direction / np.linalg.norm(direction) - R[:, 2]))]
    counts = np.array(part.axes) > 0.0
    angle = scipy.spatial.transform.Rotation.from_matrix(R_goal.T @ R).as_rotvec()
    errors = R_goal.T @ (x - x_goal), angle
    return [float(np.linalg.norm(e[m])) for e, m in zip(errors, np.split(counts, 2), strict=True)]


def _relative(data: Any, body: int, base: int) -> tuple[FloatArray, FloatArray]:
    R, R_base = (data.xmat[i].reshape(3, 3) for i in (body, base))
    return R_base.T @ (data.xpos[body] - data.xpos[base]), R_base.T @ R


def _data(model: Any, q: FloatArray) -> Any:
    """Return the data of a configuration in MuJoCo."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data
