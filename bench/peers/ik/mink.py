"""mink: differential inverse kinematics on MuJoCo by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits, and takes at most
the part `limit_gain` of the way to a limit. With full steps, the damping of the task must not be
zero: they then jump about.
"""

from functools import partial
from typing import Any

import mink

from ...problems.evaluate import mujoco_model
from .differential import reaching
from .protocol import Ask, BenchRobot, PoseRequest, Solve, Tolerance

METERED = True


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-12,
    lm_damping: float = 0.01,
    gain: float = 1.0,
    limit_gain: float = 0.95,
) -> Ask:
    """Return the solver, set up for a robot."""
    configuration = mink.Configuration(mujoco_model(robot))
    limits, cost = [mink.ConfigurationLimit(configuration.model, limit_gain)], float(robot.oriented)
    tasks = [
        mink.FrameTask(effector, "body", 1.0, cost, gain, lm_damping)
        for effector in robot.effectors
    ]
    goal = (robot, tolerance, iterations)
    options: dict[str, Any] = {"damping": damping, "limits": limits}
    reach = reaching(mink.solve_ik, configuration, tasks, *goal, **options)

    def ask(request: PoseRequest) -> Solve:
        targets = [
            mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(R), x)
            for x, R in request.poses
        ]
        solve = partial(reach, targets, request.start)
        return Solve(solve, lambda claim: (configuration.q.copy(), claim))

    return ask
