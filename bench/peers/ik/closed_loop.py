"""Pinocchio's closed-loop inverse kinematics, as in its documentation.

The velocity is v = -J' (J J' + damping I)^-1 e, with e the logarithm of the transform from the
effector to its target. The documentation takes at most 1,000 steps of 0.1 s. Limits are ignored.
"""

from typing import Any

import numpy as np

from ...problems.evaluate import from_pinocchio, pinocchio_model, to_pinocchio
from ..peer import ONE_START, Peer, Run, restarted
from ..protocol import BenchRobot, FloatArray, PoseRequest, Solve, SolveFactory, Tolerance

PEER = Peer(
    "Pinocchio’s closed loop",
    __name__,
    "pin",
    "BSD-3-Clause",
    "damped least squares with small steps (CLIK)",
    "poses and positions of several effectors, balls; looks at no limits",
    (
        # The search chose the damping on the tuning robots; steps are the documentation's.
        Run(ONE_START, {"iterations": 1000, "damping": 1e-4, "step": 0.1}),
        # Long steps leave iterations for attempts.
        restarted(50, {"damping": 1e-6, "step": 0.5}),
    ),
    label="our closed loop on Pinocchio",
    built_on="Pinocchio",
    use="a few lines without limits",
    is_loop=True,
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 1000,
    damping: float = 1e-12,
    step: float = 0.1,
) -> SolveFactory:
    """Return the loop, set up for a robot, with steps so long [s]."""
    import pinocchio

    model = pinocchio_model(robot)
    data = model.createData()
    frames = [model.getFrameId(effector) for effector in robot.effectors]

    def make_solve(request: PoseRequest) -> Solve:
        targets = [pinocchio.SE3(R, x) for x, R in request.poses]
        q0 = to_pinocchio(robot, request.start)

        def solve() -> tuple[FloatArray, bool]:
            q = q0
            for iteration in range(iterations + 1):
                e, J = compute_error(q, targets)
                is_done = bool(np.linalg.norm(e) < tolerance.position)
                if is_done or iteration == iterations:
                    break
                damped = J @ J.T + damping * np.eye(len(e))
                q = pinocchio.integrate(model, q, -step * (J.T @ np.linalg.solve(damped, e)))
            return q, is_done

        return Solve(solve, lambda answer: (from_pinocchio(robot, answer[0]), answer[1]))

    def compute_error(q: FloatArray, targets: list[Any]) -> tuple[FloatArray, FloatArray]:
        """Return the errors of all effectors and their derivative; angles only if oriented."""
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        errors, slopes = [], []
        for frame, target in zip(frames, targets, strict=True):
            to_target = data.oMf[frame].actInv(target)
            J = pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL)
            if robot.oriented:
                errors.append(pinocchio.log(to_target).vector)
                slopes.append(-pinocchio.Jlog6(to_target.inverse()) @ J)
            else:
                errors.append(to_target.translation)
                slopes.append(-J[:3])
        return np.concatenate(errors), np.vstack(slopes)

    return make_solve
