"""ur_analytic_ik: closed forms for the arms of Universal Robots, with constants of the maker.

A robot is one of its models if both agree on the effector: apart from a half turn of the root,
which the maker's files have, and from a tool. Its time is that of `inverse_kinematics`, which
returns all solutions: the choice among them is its user's.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import ur_analytic_ik

from ...problems.evaluate import Evaluator
from ...problems.robots import UnableError
from .axes import first_within
from .protocol import Ask, BenchRobot, FloatArray, Forward, PoseRequest, Solve, Tolerance

HINGES, SAMPLES = 6, 20
# Of positions [m] and of rotation matrices: a model whose lengths are rounded otherwise is another.
AGREEMENT = 1e-6


class RobotModel(NamedTuple):
    """A model, and its frames in the robot's."""

    solver: Any  # the module of its functions
    root: FloatArray  # the transform from the robot's root to the model's, (4, 4)
    tool: FloatArray  # from the model's effector to the robot's, (4, 4)

    def pose(self, q: FloatArray) -> FloatArray:
        """Return the robot's effector by the model's kinematics, (4, 4)."""
        return self.root @ self.solver.forward_kinematics(*q) @ self.tool


def prepare(robot: BenchRobot, tolerance: Tolerance) -> Ask:
    """Return the solver, set up for a robot; it takes no tolerance."""
    return _asking(robot, lambda solutions: first_within(robot, solutions))


def prepare_all(robot: BenchRobot) -> Ask:
    """Return the solver of all solutions, set up for a robot."""
    return _asking(robot, lambda solutions: (solutions, None))


def _asking(robot: BenchRobot, choose: Callable[[FloatArray], Any]) -> Ask:
    model = model_of(robot)
    from_root, from_tool = np.linalg.inv(model.root), np.linalg.inv(model.tool)

    def read(solutions: Sequence[FloatArray]) -> Any:
        return choose(np.reshape(solutions, (-1, HINGES)))

    def ask(request: PoseRequest) -> Solve:
        target = from_root @ request.matrix @ from_tool
        return Solve(partial(model.solver.inverse_kinematics, target), read)

    return ask


def kinematics(robot: BenchRobot) -> Forward:
    """Return its forward kinematics of the effector."""
    return model_of(robot).pose


def model_of(robot: BenchRobot) -> RobotModel:
    """Return the model whose forward kinematics is the robot's.

    Raises:
        UnableError: if there is none.
    """
    robot.require_chain()
    names = [name for name in dir(ur_analytic_ik) if name.startswith("ur")]
    roots = np.eye(4), np.diag([-1.0, -1.0, 1.0, 1.0])
    q = robot.draw(np.random.default_rng(0), SAMPLES)
    poses = np.tile(np.eye(4), (SAMPLES, 1, 1))
    positions, rotations = Evaluator(robot).forward(q)
    poses[:, :3, :3], poses[:, :3, 3] = rotations[:, 0], positions[:, 0]
    for name, root in product(names if len(robot.joints) == HINGES else (), roots):
        solver = getattr(ur_analytic_ik, name)
        tool = np.linalg.inv(root @ solver.forward_kinematics(*q[0])) @ poses[0]
        model = RobotModel(solver, root, tool)
        if np.abs(np.array([*map(model.pose, q)]) - poses).max() <= AGREEMENT:
            return model
    raise UnableError("has models of Universal Robots only")
