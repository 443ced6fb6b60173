"""PyBullet: `calculateInverseKinematics`, damped least squares in double precision.

Without limits it takes a damping; the default of 0.5 converges too slowly for our tolerance. With
limits it pulls towards them in the null space of the effector's motion, does not take the damping,
hardly arrives and oversteps them all the same. It never says whether it has arrived: a caller who
starts it again must look at its forward kinematics, which `check` does. `IK_SDLS` ends the process,
and is left out.
"""

import functools
from typing import Any

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation

from .protocol import (
    Ask,
    FloatArray,
    Forward,
    Robot,
    Solve,
    SolverOutput,
    Tolerance,
    needs_a_chain,
    robot_file,
)

# It stops within this part of the tolerance, which bounds a distance; angles come along.
INSIDE = 0.1


def prepare(
    robot: Robot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-3,
    limits: bool = False,
    check: bool = False,
) -> Ask:
    """Return the solver, set up for a robot, with a damping or with limits."""
    needs_a_chain(robot)
    body = BulletBody(robot)
    shared = {
        "maxNumIterations": iterations,
        "residualThreshold": INSIDE * tolerance.position,
        "physicsClientId": body.client,
        **(_limits(robot) if limits else {"jointDamping": [damping] * len(robot.joints)}),
    }

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        quaternion = Rotation.from_matrix(rotations[0]).as_quat().tolist()
        target = body.number, body.effector, positions[0].tolist(), quaternion
        more = {"currentPositions": start.tolist()}
        more |= {"restPoses": start.tolist()} if limits else {}

        def solve() -> SolverOutput:
            q = np.array(pybullet.calculateInverseKinematics(*target, **more, **shared))
            done = body.is_at(q, positions[0], rotations[0], tolerance) if check else None
            return SolverOutput(q, done)

        return solve

    return ask


def kinematics(robot: Robot) -> Forward:
    """Return PyBullet's forward kinematics of the effector."""
    needs_a_chain(robot)
    body = BulletBody(robot)

    def forward(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        position, rotation = body.forward(q)
        return position[None], rotation[None]

    return forward


class BulletBody:
    """A robot in PyBullet.

    Attributes:
        client: of the physics server.
        number: of the body there.
        effector: the index of its link.
    """

    def __init__(self, robot: Robot) -> None:
        """Load the robot; fixed joints have links of their own."""
        self.client = _client()
        with robot_file(robot) as file:
            self.number = pybullet.loadURDF(file, useFixedBase=True, physicsClientId=self.client)
        joints = range(pybullet.getNumJoints(self.number, physicsClientId=self.client))
        facts = [pybullet.getJointInfo(self.number, joint, self.client) for joint in joints]
        self._joints = [fact[0] for fact in facts if fact[2] == pybullet.JOINT_REVOLUTE]
        self.effector = next(f[0] for f in facts if f[12].decode() == robot.effectors[0])

    def forward(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the effector's position [m], (3,), and rotation, (3, 3)."""
        for joint, value in zip(self._joints, q, strict=True):
            pybullet.resetJointState(self.number, joint, value, physicsClientId=self.client)
        state = pybullet.getLinkState(
            self.number, self.effector, computeForwardKinematics=True, physicsClientId=self.client
        )
        R = np.array(pybullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
        return np.array(state[4]), R

    def is_at(self, q: FloatArray, x: FloatArray, R: FloatArray, tolerance: Tolerance) -> bool:
        """Return whether these coordinates bring the effector to a target."""
        position, rotation = self.forward(q)
        angle = np.linalg.norm(rotation - R) / np.sqrt(2.0)  # where it is small
        return bool(
            np.linalg.norm(position - x) <= tolerance.position and angle <= tolerance.rotation
        )


def _limits(robot: Robot) -> dict[str, Any]:
    return {
        "lowerLimits": robot.lower.tolist(),
        "upperLimits": robot.upper.tolist(),
        "jointRanges": (robot.upper - robot.lower).tolist(),
    }


@functools.cache
def _client() -> int:
    return int(pybullet.connect(pybullet.DIRECT))
