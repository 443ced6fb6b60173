"""DART: its inverse kinematics of one effector, damped steps by its gradient descent solver.

The error is bounded by a cube within the ball of tolerance, and so is a rotation; the solver keeps
the joints' limits. DART's own restarts draw from a generator without a seed, so they are left out.
"""

import dartpy
import numpy as np

from .protocol import Ask, FloatArray, Forward, Robot, Solve, SolverOutput, Tolerance, needs_a_chain


def prepare(robot: Robot, tolerance: Tolerance, iterations: int = 200) -> Ask:
    """Return the solver, set up for a robot."""
    needs_a_chain(robot)
    skeleton = dart_skeleton(robot)
    ik = skeleton.getBodyNode(robot.effectors[0]).getIK(True)
    goal = dartpy.dynamics.SimpleFrame(dartpy.dynamics.Frame.World(), "target")
    ik.setTarget(goal)
    side = np.repeat([tolerance.rotation, tolerance.position], 3) / np.sqrt(3.0)
    ik.getErrorMethod().setBounds(-side, side)
    ik.getSolver().setNumMaxIterations(iterations)

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        target = dartpy.math.Isometry3()
        target.set_rotation(rotations[0])
        target.set_translation(positions[0])

        def solve() -> SolverOutput:
            goal.setTransform(target)
            skeleton.setPositions(start)
            done = ik.solveAndApply(True)
            return SolverOutput(skeleton.getPositions(), bool(done))

        return solve

    return ask


def kinematics(robot: Robot) -> Forward:
    """Return DART's forward kinematics of the effector."""
    needs_a_chain(robot)
    skeleton = dart_skeleton(robot)
    effector = skeleton.getBodyNode(robot.effectors[0])

    def forward(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        skeleton.setPositions(q)
        T = effector.getWorldTransform().matrix()
        return T[None, :3, 3], T[None, :3, :3]

    return forward


def dart_skeleton(robot: Robot) -> dartpy.dynamics.Skeleton:
    """Return a chain in DART, its root fixed in the world and its joints in the robot's order.

    Raises:
        ValueError: if DART does not read it, or orders the joints otherwise.
    """
    loader, options = dartpy.utils.DartLoader(), dartpy.utils.DartLoaderOptions()
    options.mDefaultRootJointType = dartpy.utils.DartLoaderRootJointType.FIXED
    loader.setOptions(options)
    skeleton = loader.parseSkeletonString(robot.text, dartpy.common.Uri())
    if skeleton is None:
        raise ValueError("DART does not read the robot")
    names = tuple(freedom.getName() for freedom in skeleton.getDofs())
    if names != robot.joints:
        raise ValueError(f"DART orders the joints as {', '.join(names)}")
    return skeleton
