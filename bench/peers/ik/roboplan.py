"""roboplan: OInK, differential inverse kinematics by quadratic programs in C++ on Pinocchio.

Each step asks for a part of the error (`gain`) within the joint limits. A step takes at most the
part `limit_gain` of the way to a limit. `damping` is the regularization of the program. Its
solutions keep limits to 1e-6 only, so joints are clamped, as its users would.
"""

from math import hypot
from typing import Any

import numpy as np

from ...clock import library
from ..peer import ONE_START, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, Forward, PoseRequest, Solve, SolveFactory, Tolerance

# The search chose these on the tuning robots (docs/peers/index.md).
_LIMITS = {"gain": 1.0, "limit_gain": 0.5}
_SETTINGS = {"damping": 1e-12, "lm_damping": 0.0, **_LIMITS}
PEER = Peer(
    "roboplan OInK",
    __name__,
    "roboplan-oink",
    "MIT",
    "differential inverse kinematics by quadratic programs",
    "poses and limits of one chain of hinges",
    (
        Run(ONE_START, {"iterations": 200, "damping": 1e-6, "lm_damping": 0.001, **_LIMITS}),
        # As the search chose.
        short_attempts({**_SETTINGS, "lm_damping": 1e-3, "limit_gain": 1.0}),
        restarted(25, _SETTINGS),
    ),
    built_on="Pinocchio",
    use="task loops in C++",
)

METERED = True
GROUP = "arm"


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-12,
    lm_damping: float = 0.0,
    gain: float = 1.0,
    limit_gain: float = 1.0,
) -> SolveFactory:
    """Return the solver, set up for a robot."""
    from roboplan import core, optimal_ik

    scene = scene_of(robot)
    oink, frames = optimal_ik.Oink(scene, GROUP), (robot.effectors[0], robot.root)
    pose = core.CartesianConfiguration(robot.root, robot.effectors[0], np.eye(4))
    options = optimal_ik.FrameTaskOptions(task_gain=gain, lm_damping=lm_damping)
    task = optimal_ik.FrameTask(oink, scene, pose, options)
    tasks, limits = [task], [optimal_ik.PositionLimit(oink, limit_gain)]
    step = np.zeros(oink.num_variables)
    solve_ik, integrate = library(oink.solveIk), library(scene.integrate)
    forward, place = library(scene.forwardKinematics), library(scene.setJointPositions)

    def reach(target: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, bool]:
        task.setTargetFrameTransform(target)
        place(q)
        for _ in range(iterations):
            if is_done(target, forward(q, *frames)):
                return q, True
            solve_ik(scene, tasks, limits, step, damping)
            q = np.clip(integrate(q, step), robot.lower, robot.upper)
            place(q)
        return q, is_done(target, forward(q, *frames))

    def is_done(target: np.ndarray, pose: np.ndarray) -> bool:
        if hypot(*(pose[:3, 3] - target[:3, 3]).tolist()) > tolerance.position:
            return False
        return rotation_angle(pose[:3, :3], target[:3, :3]) <= tolerance.rotation

    def make_solve(request: PoseRequest) -> Solve:
        matrix, start = np.asfortranarray(request.matrix), request.start.copy()
        return Solve(lambda: reach(matrix, start), lambda answer: answer)

    return make_solve


def rotation_angle(a: np.ndarray, b: np.ndarray) -> float:
    """Return the angle between two rotation matrices [rad]."""
    return 2.0 * float(np.arcsin(min(1.0, np.linalg.norm(a - b) / np.sqrt(8.0))))


def kinematics(robot: BenchRobot) -> Forward:
    """Return roboplan's forward kinematics of the effector."""
    scene, frames = scene_of(robot), (robot.effectors[0], robot.root)
    return lambda q: scene.forwardKinematics(q, *frames)


def scene_of(robot: BenchRobot) -> Any:
    """Return a scene with the chain, its joints in a group.

    Raises:
        UnableError: if the robot is no chain.
        ValueError: if its joints are ordered otherwise.
    """
    from roboplan import core

    robot.require_chain()
    scene = core.Scene(robot.name, core.loadUrdfSceneDescriptionFromXml(robot.text))
    robot.check_order("roboplan", scene.getJointNames())
    scene.addGroup(GROUP, list(robot.joints))
    return scene
