"""Pinocchio's closed-loop inverse kinematics, as in its documentation.

The velocity is v = -J' (J J' + damping I)^-1 e, with e the logarithm of the transform from the
effector to its target. The documentation takes at most 1,000 steps of 0.1 s. Limits are ignored.
"""

from collections.abc import Sequence

import numpy as np
import pinocchio

from ...problems.evaluate import from_pinocchio, pinocchio_model, to_pinocchio
from ..protocol import Ask, BenchRobot, FloatArray, PoseRequest, Solve, Tolerance


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 1000,
    damping: float = 1e-12,
    step: float = 0.1,
) -> Ask:
    """Return the loop, set up for a robot, with steps so long [s]."""
    model = pinocchio_model(robot)
    data = model.createData()
    frames = [model.getFrameId(effector) for effector in robot.effectors]

    def ask(request: PoseRequest) -> Solve:
        targets = [pinocchio.SE3(R, x) for x, R in request.poses]
        q0 = to_pinocchio(robot, request.start)

        def solve() -> tuple[FloatArray, bool]:
            q = q0
            for iteration in range(iterations + 1):
                e, J = _error(model, data, q, frames, targets, robot.oriented)
                is_done = bool(np.linalg.norm(e) < tolerance.position)
                if is_done or iteration == iterations:
                    break
                damped = J @ J.T + damping * np.eye(len(e))
                q = pinocchio.integrate(model, q, -step * (J.T @ np.linalg.solve(damped, e)))
            return q, is_done

        return Solve(solve, lambda answer: (from_pinocchio(robot, answer[0]), answer[1]))

    return ask


def _error(
    model: pinocchio.Model,
    data: pinocchio.Data,
    q: FloatArray,
    frames: Sequence[int],
    targets: Sequence[pinocchio.SE3],
    oriented: bool,
) -> tuple[FloatArray, FloatArray]:
    """Return the error of all effectors and its derivative; of positions only unless `oriented`."""
    pinocchio.computeJointJacobians(model, data, q)
    pinocchio.updateFramePlacements(model, data)
    errors, slopes = [], []
    for frame, target in zip(frames, targets, strict=True):
        to_target = data.oMf[frame].actInv(target)
        J = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL)
        if oriented:
            errors.append(pinocchio.log(to_target).vector)
            slopes.append(-pinocchio.Jlog6(to_target.inverse()) @ J)
        else:
            errors.append(to_target.translation)
            slopes.append(-J[:3])
    return np.concatenate(errors), np.vstack(slopes)
