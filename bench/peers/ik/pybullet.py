"""PyBullet: `calculateInverseKinematics`, damped least squares in double precision.

Without limits there is a damping; the default of 0.5 converges too slowly for our tolerance. With
limits PyBullet pulls towards the limits in the null space of the effector's motion, without the
damping, hardly arrives and still oversteps limits. There is no report of success: for restarts
`check` compares the forward kinematics of an answer with the target, untimed. `IK_SDLS` ends the
process, and is left out.
"""

import functools
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from ..peer import ONE_START, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, FloatArray, Forward, PoseRequest, Solve, SolveFactory, Tolerance

# The search chose these on the tuning robots (docs/peers/index.md).
_SETTINGS = {"damping": 1e-3, "inside": 0.1}
PEER = Peer(
    "PyBullet",
    __name__,
    "pybullet",
    "Zlib",
    "damped least squares",
    "poses of one chain of hinges; limits only as a pull in the null space, with which it hardly "
    "arrives and oversteps them all the same; makes no claims",
    (
        Run(ONE_START, {"iterations": 200, "damping": 1e-4, "inside": 0.1}, "limits left out"),
        # As its manual has limits.
        Run(ONE_START, {"limits": True}, "limits in the null space"),
        # Without a claim of its own, another attempt has no reason.
        short_attempts(
            {"check": True, **_SETTINGS, "damping": 1e-4}, "{}, its answer checked by us"
        ),
        restarted(20, {"check": True, **_SETTINGS}, "{}, its answer checked by us"),
    ),
    use="robots in PyBullet",
    precision="reads the file, and gives poses, in single precision",
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-3,
    inside: float = 0.1,
    limits: bool = False,
    check: bool = False,
) -> SolveFactory:
    """Return the solver, set up for a robot, with a damping or with limits.

    The solver stops within the part `inside` of the tolerance on distance; angles come along.
    """
    body = BulletBody(robot)
    options: dict[str, Any] = {
        "maxNumIterations": iterations,
        "residualThreshold": inside * tolerance.position,
        "physicsClientId": body.client,
    }
    if limits:
        options |= {"lowerLimits": robot.lower.tolist(), "upperLimits": robot.upper.tolist()}
        options |= {"jointRanges": (robot.upper - robot.lower).tolist()}
    else:
        options |= {"jointDamping": [damping] * len(robot.joints)}

    def make_solve(request: PoseRequest) -> Solve:
        pose = request.positions[0].tolist(), request.quaternion.tolist()
        start = request.start.tolist()
        poses = {"currentPositions": start} | ({"restPoses": start} if limits else {})
        target = body.number, body.effector, *pose
        solve = partial(body.engine.calculateInverseKinematics, *target, **poses, **options)

        def read(q: tuple[float, ...]) -> tuple[tuple[float, ...], bool | None]:
            return q, body.is_at(q, request, tolerance) if check else None

        return Solve(solve, read)

    return make_solve


def kinematics(robot: BenchRobot) -> Forward:
    """Return PyBullet's forward kinematics of the effector."""
    return BulletBody(robot).forward


class BulletBody:
    """A robot in PyBullet.

    Attributes:
        engine: PyBullet.
        client: of the physics server.
        number: of the body there.
        effector: the index of its link.
    """

    def __init__(self, robot: BenchRobot) -> None:
        """Load the robot; fixed joints have links of their own."""
        import pybullet

        robot.require_chain()
        self.engine, self.client = pybullet, _client()
        with robot.file() as file:
            self.number = pybullet.loadURDF(file, useFixedBase=True, physicsClientId=self.client)
        joints = range(pybullet.getNumJoints(self.number, physicsClientId=self.client))
        facts = [pybullet.getJointInfo(self.number, joint, self.client) for joint in joints]
        self._joints = [fact[0] for fact in facts if fact[2] == pybullet.JOINT_REVOLUTE]
        self.effector = next(f[0] for f in facts if f[12].decode() == robot.effectors[0])

    def forward(self, q: Sequence[float] | FloatArray) -> FloatArray:
        """Return the effector's transform, (4, 4)."""
        for joint, angle in zip(self._joints, q, strict=True):
            self.engine.resetJointState(self.number, joint, angle, physicsClientId=self.client)
        state = self.engine.getLinkState(
            self.number, self.effector, computeForwardKinematics=True, physicsClientId=self.client
        )
        T = np.eye(4)
        T[:3, :3] = np.reshape(self.engine.getMatrixFromQuaternion(state[5]), (3, 3))
        T[:3, 3] = state[4]
        return T

    def is_at(self, q: Sequence[float], request: PoseRequest, tolerance: Tolerance) -> bool:
        """Return whether these coordinates bring the effector to its target."""
        difference = self.forward(q) - request.matrix
        distance = np.linalg.norm(difference[:3, 3])
        angle = np.linalg.norm(difference[:3, :3]) / np.sqrt(2.0)  # where it is small
        return bool(distance <= tolerance.position and angle <= tolerance.rotation)


@functools.cache
def _client() -> int:
    import pybullet

    return int(pybullet.connect(pybullet.DIRECT))
