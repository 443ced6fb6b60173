"""mink: differential inverse kinematics on MuJoCo by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits. A step takes at
most the part `limit_gain` of the way to a limit. Without damping of the task, full steps jump
about.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from ...problems.evaluate import evaluator_of, mujoco_model
from ...problems.robot_tasks import POSTURE_COST, RobotTask, TaskPart, TaskRequest, first_link
from ..differential import PhasedReach, further_starts, meeting, reaching
from ..peer import ONE_START, PORTFOLIO, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, PoseRequest, Solve, SolveFactory, Tolerance

# The search chose these on the tuning robots (docs/peers/mink.md).
_SETTINGS = {"damping": 1e-12, "lm_damping": 0.001, "gain": 1.0, "limit_gain": 0.95}
_CAUTIOUS = {**_SETTINGS, "limit_gain": 0.5}
PEER = Peer(
    "mink",
    __name__,
    "mink",
    "Apache-2.0",
    "differential inverse kinematics by quadratic programs",
    "poses, positions and limits of several effectors, balls",
    (
        Run(ONE_START, {"iterations": 200, **_CAUTIOUS}),
        # Our phases, which need no random poses.
        Run(PORTFOLIO, {"iterations": 100, **_CAUTIOUS, "phases": 8}, "eight phases"),
        short_attempts(_SETTINGS),
        restarted(25, _SETTINGS),
    ),
    built_on="MuJoCo",
    use="task loops on MuJoCo",
)

METERED = True


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-12,
    lm_damping: float = 0.01,
    gain: float = 1.0,
    limit_gain: float = 0.95,
    phases: int = 1,
) -> SolveFactory:
    """Return the solver, set up for a robot."""
    import mink

    configuration = mink.Configuration(mujoco_model(robot))
    limits, cost = [mink.ConfigurationLimit(configuration.model, limit_gain)], float(robot.oriented)
    tasks = [
        mink.FrameTask(effector, "body", 1.0, cost, gain, lm_damping)
        for effector in robot.effectors
    ]
    goal = (robot, tolerance, iterations)
    options: dict[str, Any] = {"damping": damping, "limits": limits}
    reach: Callable[..., bool] = reaching(mink.solve_ik, configuration, tasks, *goal, **options)
    if phases > 1:
        starts = further_starts(robot, phases)
        reach = PhasedReach(mink.solve_ik, configuration, tasks[0], goal, starts, **options)

    def make_solve(request: PoseRequest) -> Solve:
        targets = [
            mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(R), x)
            for x, R in request.poses
        ]
        solve = partial(reach, targets, request.start)
        return Solve(solve, lambda claim: (configuration.q.copy(), claim))

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
    """Return the solver of a task, set up for an arm."""
    import mink

    configuration = mink.Configuration(mujoco_model(robot))
    limits = [mink.ConfigurationLimit(configuration.model, limit_gain)]
    parts = [_task(robot, part, configuration.model, gains) for part in task.parts]
    goal = (robot, task, tolerance, iterations)
    options: dict[str, Any] = {"damping": damping, "limits": limits}
    return meeting(mink.solve_ik, configuration, parts, *goal, **options)


def _task(robot: BenchRobot, part: TaskPart, model: Any, gains: dict[str, float]) -> Any:
    import mink

    frame = (robot.effectors[0], "body")
    match part.kind:
        case "look_at":
            return mink.LookAtTask(*frame, **gains)
        case "centre_of_mass":
            return mink.ComTask(1.0, **gains)
        case "posture":
            return mink.PostureTask(model, POSTURE_COST, **gains)
    base = (first_link(evaluator_of(robot.name)), "body")
    kind = mink.RelativeFrameTask if part.is_relative else mink.FrameTask
    return kind(*frame, *base * part.is_relative, part.axes[:3], part.axes[3:], **gains)
