"""mink: differential inverse kinematics on MuJoCo by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits. With full steps,
the damping of the task must not be zero: they then jump about.
"""

import mink

from ...problems.evaluate import mujoco_model
from .protocol import Ask, BenchRobot, PoseRequest, Solve, SolverOutput, Tolerance, arrived, iterate


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-12,
    lm_damping: float = 0.01,
    gain: float = 1.0,
) -> Ask:
    """Return the solver, set up for a robot."""
    configuration = mink.Configuration(mujoco_model(robot))
    limits, cost = [mink.ConfigurationLimit(configuration.model)], float(robot.oriented)
    tasks = [
        mink.FrameTask(effector, "body", 1.0, cost, gain, lm_damping)
        for effector in robot.effectors
    ]

    options = {"solver": "daqp", "damping": damping, "limits": limits}

    def step() -> None:
        velocity = mink.solve_ik(configuration, tasks, 1.0, **options)
        configuration.integrate_inplace(velocity, 1.0)

    def is_done() -> bool:
        return arrived([task.compute_error(configuration) for task in tasks], robot, tolerance)

    def ask(request: PoseRequest) -> Solve:
        targets = [
            mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(R), x)
            for x, R in request.poses
        ]

        def solve() -> SolverOutput:
            for task, target in zip(tasks, targets, strict=True):
                task.set_target(target)
            configuration.update(request.start)
            claim = iterate(step, is_done, iterations)
            return SolverOutput(configuration.q.copy(), claim)

        return solve

    return ask
