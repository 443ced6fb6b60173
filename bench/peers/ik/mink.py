"""mink: differential inverse kinematics on MuJoCo by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits, and takes at most
the part `limit_gain` of the way to a limit. With full steps, the damping of the task must not be
zero: they then jump about.
"""

import mink

from ...problems.evaluate import mujoco_model
from .overhead import library
from .protocol import Ask, BenchRobot, PoseRequest, Solve, Tolerance, arrived, iterate

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

    options = {"solver": "daqp", "damping": damping, "limits": limits}
    solve_ik, integrate = library(mink.solve_ik), library(configuration.integrate_inplace)
    compute_errors = [library(task.compute_error) for task in tasks]
    setters, update = [library(task.set_target) for task in tasks], library(configuration.update)

    def step() -> None:
        integrate(solve_ik(configuration, tasks, 1.0, **options), 1.0)

    def is_done() -> bool:
        return arrived([compute(configuration) for compute in compute_errors], robot, tolerance)

    def ask(request: PoseRequest) -> Solve:
        targets = [
            mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(R), x)
            for x, R in request.poses
        ]

        def solve() -> bool:
            for set_target, target in zip(setters, targets, strict=True):
                set_target(target)
            update(request.start)
            return iterate(step, is_done, iterations)

        return Solve(solve, lambda claim: (configuration.q.copy(), claim))

    return ask
