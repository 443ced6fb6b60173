"""pink: differential inverse kinematics by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits, and takes at most
the part `limit_gain` of the way to a limit. An effector without a target rotation has no cost for
it. Velocity limits are left out: there is no motion here. With pink's own damping of 1e-12 the
quadratic program is infeasible, and pink raises `NoSolutionFound`, once a step leaves a joint 1e-7
beyond its limit; with 1e-6 it never is here.
"""

import logging
from functools import partial
from typing import Any

import pink

from ...problems.evaluate import from_pinocchio, pinocchio_model, to_pinocchio
from .differential import reaching
from .protocol import Ask, BenchRobot, PoseRequest, Solve, Tolerance

METERED = True


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-6,
    lm_damping: float = 0.0,
    gain: float = 1.0,
    limit_gain: float = 0.5,
) -> Ask:
    """Return the solver, set up for a robot."""
    logging.getLogger().setLevel(logging.ERROR)  # it warns of each step beyond a limit
    model, cost = pinocchio_model(robot), float(robot.oriented)
    start = pink.configuration.pin.neutral(model)
    configuration = pink.Configuration(model, model.createData(), start, copy_data=False)
    limits = [pink.limits.ConfigurationLimit(model, limit_gain)]
    tasks = [pink.FrameTask(effector, 1.0, cost, lm_damping, gain) for effector in robot.effectors]
    goal = (robot, tolerance, iterations)
    options: dict[str, Any] = {"damping": damping, "limits": limits, "safety_break": False}
    reach = reaching(pink.solve_ik, configuration, tasks, *goal, **options)

    def ask(request: PoseRequest) -> Solve:
        targets = [pink.configuration.pin.SE3(R, x) for x, R in request.poses]
        solve = partial(reach, targets, to_pinocchio(robot, request.start))
        return Solve(solve, lambda claim: (from_pinocchio(robot, configuration.q), claim))

    return ask
