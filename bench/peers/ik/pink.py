"""pink: differential inverse kinematics by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits. A step takes at
most the part `limit_gain` of the way to a limit. Without a target rotation, an effector's rotation
costs nothing. Velocity limits are left out: there is no motion here. With pink's own damping of
1e-12, a joint 1e-7 beyond its limit makes the quadratic program infeasible, and pink raises
`NoSolutionFound`. With 1e-6 all programs here are feasible.
"""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from ...problems.evaluate import evaluator_of, from_pinocchio, pinocchio_model, to_pinocchio
from ...problems.robot_tasks import POSTURE_COST, RobotTask, TaskPart, TaskRequest, first_link
from ..differential import PhasedReach, further_starts, meeting, reaching
from ..peer import ONE_START, PORTFOLIO, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, PoseRequest, Solve, SolveFactory, Tolerance, UnableError

# The search chose these on the tuning robots (docs/peers/pink.md).
_SETTINGS = {"damping": 1e-6, "lm_damping": 0.0, "gain": 1.0, "limit_gain": 0.5}
PEER = Peer(
    "pink",
    __name__,
    "pin-pink",
    "Apache-2.0",
    "differential inverse kinematics by quadratic programs",
    "poses, positions and limits of several effectors, balls",
    (
        Run(ONE_START, {"iterations": 200, **_SETTINGS}),
        # Our phases, which need no random poses.
        Run(PORTFOLIO, {"iterations": 100, **_SETTINGS, "phases": 8}, "eight phases"),
        short_attempts(_SETTINGS),
        restarted(25, _SETTINGS),
    ),
    built_on="Pinocchio",
    use="task loops on Pinocchio",
)

METERED = True


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-6,
    lm_damping: float = 0.0,
    gain: float = 1.0,
    limit_gain: float = 0.5,
    phases: int = 1,
) -> SolveFactory:
    """Return the solver, set up for a robot."""
    import pink

    configuration, cost = _configuration(robot), float(robot.oriented)
    limits = [pink.limits.ConfigurationLimit(configuration.model, limit_gain)]
    tasks = [pink.FrameTask(effector, 1.0, cost, lm_damping, gain) for effector in robot.effectors]
    goal = (robot, tolerance, iterations)
    options: dict[str, Any] = {"damping": damping, "limits": limits, "safety_break": False}
    reach: Callable[..., bool] = reaching(pink.solve_ik, configuration, tasks, *goal, **options)
    if phases > 1:
        starts = [to_pinocchio(robot, q) for q in further_starts(robot, phases)]
        reach = PhasedReach(pink.solve_ik, configuration, tasks[0], goal, starts, **options)

    def make_solve(request: PoseRequest) -> Solve:
        targets = [pink.configuration.pin.SE3(R, x) for x, R in request.poses]
        solve = partial(reach, targets, to_pinocchio(robot, request.start))
        return Solve(solve, lambda claim: (from_pinocchio(robot, configuration.q), claim))

    return make_solve


def prepare_task(
    robot: BenchRobot,
    task: RobotTask,
    tolerance: float,
    iterations: int,
    damping: float,
    limit_gain: float,
    **gains: float,
) -> Callable[[TaskRequest], Solve]:
    """Return the solver of a task, set up for an arm.

    Raises:
        UnableError: if pink has no such task.
    """
    import pink

    configuration = _configuration(robot)
    limits = [pink.limits.ConfigurationLimit(configuration.model, limit_gain)]
    parts = [_task(robot, part, gains) for part in task.parts]
    goal = (robot, task, tolerance, iterations)
    options: dict[str, Any] = {"damping": damping, "limits": limits, "safety_break": False}
    return meeting(pink.solve_ik, configuration, parts, *goal, **options)


def _configuration(robot: BenchRobot) -> Any:
    import pink

    logging.getLogger().setLevel(logging.ERROR)  # it warns of each step beyond a limit
    model = pinocchio_model(robot)
    start = pink.configuration.pin.neutral(model)
    return pink.Configuration(model, model.createData(), start, copy_data=False)


def _task(robot: BenchRobot, part: TaskPart, gains: dict[str, float]) -> Any:
    import pink

    match part.kind:
        case "look_at":
            raise UnableError("has no task to look at a point")
        case "centre_of_mass":
            return pink.tasks.ComTask(1.0, **gains)
        case "posture":
            return pink.PostureTask(POSTURE_COST, **gains)
    frames = (robot.effectors[0], first_link(evaluator_of(robot.name)))
    kind = pink.tasks.RelativeFrameTask if part.is_relative else pink.FrameTask
    return kind(*frames[: 1 + part.is_relative], part.axes[:3], part.axes[3:], **gains)
