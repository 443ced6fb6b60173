"""Pinocchio's closed-loop inverse kinematics, as its documentation gives it.

The error of the effector is the logarithm of the transform from it to its target, the velocity
v = -J' (J J' + damping I)^-1 e, the step 0.1 s, at most 1,000 of them. It looks at no limits.
"""

from collections.abc import Sequence

import numpy as np
import pinocchio

from .pinocchio_model import from_pinocchio, pinocchio_model, to_pinocchio
from .protocol import Ask, FloatArray, Robot, Solve, SolverOutput, Tolerance

STEP = 0.1
DAMPING = 1e-12


def prepare(robot: Robot, tolerance: Tolerance, iterations: int = 1000) -> Ask:
    """Return the loop, set up for a robot."""
    model = pinocchio_model(robot)
    data = model.createData()
    frames = [model.getFrameId(effector) for effector in robot.effectors]

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        targets = [pinocchio.SE3(R, x) for R, x in zip(rotations, positions, strict=True)]
        q0 = to_pinocchio(robot, start)

        def solve() -> SolverOutput:
            q = q0
            for iteration in range(iterations + 1):
                e, J = _error(model, data, q, frames, targets, robot.oriented)
                done = bool(np.linalg.norm(e) < tolerance.position)
                if done or iteration == iterations:
                    break
                damped = J @ J.T + DAMPING * np.eye(len(e))
                q = pinocchio.integrate(model, q, -STEP * (J.T @ np.linalg.solve(damped, e)))
            return SolverOutput(from_pinocchio(robot, q), done)

        return solve

    return ask


def _error(
    model: pinocchio.Model,
    data: pinocchio.Data,
    q: FloatArray,
    frames: Sequence[int],
    targets: Sequence[pinocchio.SE3],
    posed: bool,
) -> tuple[FloatArray, FloatArray]:
    """Return the error of all effectors and its derivative, only of positions unless posed."""
    pinocchio.computeJointJacobians(model, data, q)
    pinocchio.updateFramePlacements(model, data)
    errors, slopes = [], []
    for frame, target in zip(frames, targets, strict=True):
        to_target = data.oMf[frame].actInv(target)
        J = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL)
        if posed:
            errors.append(pinocchio.log(to_target).vector)
            slopes.append(-pinocchio.Jlog6(to_target.inverse()) @ J)
        else:
            errors.append(to_target.translation)
            slopes.append(-J[:3])
    return np.concatenate(errors), np.vstack(slopes)
