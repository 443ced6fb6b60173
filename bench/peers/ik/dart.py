"""DART: its inverse kinematics of an effector, damped steps by its gradient descent solver.

The error is bounded by a cube within the ball of tolerance, and so is a rotation; the solver keeps
the joints' limits. DART's own restarts draw from a generator without a seed, and are left out.
"""

from typing import Any

import numpy as np

from ..peer import ONE_START, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, FloatArray, Forward, PoseRequest, Solve, SolveFactory, Tolerance

# The search chose these on the tuning robots (docs/peers/index.md).
_SETTINGS = {"clamp": 0.5, "length": 1.0, "weight": 1.0}
PEER = Peer(
    "DART",
    __name__,
    "dartpy",
    "BSD-2-Clause",
    "gradient descent with damped least-squares steps",
    "poses and limits of one chain of hinges",
    (
        Run(ONE_START, {"iterations": 500, "clamp": 1.0, "length": 1.0, "weight": 1.0}),
        short_attempts({**_SETTINGS, "clamp": 1.0}, count=4),  # as the search chose
        restarted(50, _SETTINGS),
    ),
    use="robots simulated in DART",
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    clamp: float = 0.2,
    length: float = 1.0,
    weight: float = 0.4,
) -> SolveFactory:
    """Return the solver, set up for a robot.

    A step is clamped to `clamp` for each joint [rad] and the error to `length`; `weight` is the
    weight of angles.
    """
    import dartpy

    skeleton = dart_skeleton(robot)
    ik = skeleton.getBodyNode(robot.effectors[0]).getIK(True)
    target_frame = dartpy.dynamics.SimpleFrame(dartpy.dynamics.Frame.World(), "target")
    ik.setTarget(target_frame)
    side = np.repeat([tolerance.rotation, tolerance.position], 3) / np.sqrt(3.0)
    ik.getErrorMethod().setBounds(-side, side)
    ik.getErrorMethod().setAngularErrorWeights(np.full(3, weight))
    ik.getErrorMethod().setErrorLengthClamp(length)
    ik.getGradientMethod().setComponentWiseClamp(clamp)
    ik.getSolver().setNumMaxIterations(iterations)

    def make_solve(request: PoseRequest) -> Solve:
        target = dartpy.math.Isometry3()
        target.set_rotation(request.rotations[0])
        target.set_translation(request.positions[0])

        def solve() -> bool:
            target_frame.setTransform(target)
            skeleton.setPositions(request.start)
            return bool(ik.solveAndApply(True))

        return Solve(solve, lambda claim: (skeleton.getPositions(), claim))

    return make_solve


def kinematics(robot: BenchRobot) -> Forward:
    """Return DART's forward kinematics of the effector."""
    skeleton = dart_skeleton(robot)
    effector = skeleton.getBodyNode(robot.effectors[0])

    def pose(q: FloatArray) -> FloatArray:
        skeleton.setPositions(q)
        return effector.getWorldTransform().matrix()

    return pose


def dart_skeleton(robot: BenchRobot) -> Any:
    """Return a chain in DART, its root fixed in the world.

    Raises:
        UnableError: if the robot is no chain.
        ValueError: if DART does not read it, or orders the joints otherwise.
    """
    import dartpy

    robot.require_chain()
    loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
    options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
    loader.setOptions(options)
    skeleton = loader.parseSkeletonString(robot.text, dartpy.common.Uri())
    if skeleton is None:
        raise ValueError("DART does not read the robot")
    robot.check_order("DART", [freedom.getName() for freedom in skeleton.getDofs()])
    return skeleton
