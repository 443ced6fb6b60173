"""mink: differential inverse kinematics on MuJoCo by quadratic programs, iterated to a target.

Each step asks for all of the error at once (gain 1 over 1 s) within the joint limits. Its damping
of the task must not be zero: full steps then jump about.
"""

import mink
import numpy as np

from plumbob.reference.arguments import FloatArray

from ...experiments.robots.evaluate import Tolerance, mujoco_model
from ...experiments.robots.problem import Robot
from .protocol import Ask, Solve, SolverOutput


def prepare(
    robot: Robot, tolerance: Tolerance, iterations: int = 200, lm_damping: float = 0.01
) -> Ask:
    """Return the solver, set up for a robot."""
    configuration = mink.Configuration(mujoco_model(robot))
    limits = [mink.ConfigurationLimit(configuration.model)]
    cost = 1.0 if robot.posed else 0.0
    tasks = [
        mink.FrameTask(effector, "body", 1.0, cost, lm_damping=lm_damping)
        for effector in robot.effectors
    ]

    def solved() -> bool:
        errors = np.array([task.compute_error(configuration) for task in tasks])
        sizes = np.linalg.norm(errors.reshape(len(tasks), 2, 3), axis=-1)
        limit = (tolerance.position, tolerance.rotation if robot.posed else np.inf)
        return bool((sizes <= limit).all())

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        targets = [
            mink.SE3.from_rotation_and_translation(mink.SO3.from_matrix(R), x)
            for R, x in zip(rotations, positions, strict=True)
        ]

        def solve() -> SolverOutput:
            for task, target in zip(tasks, targets, strict=True):
                task.set_target(target)
            configuration.update(start)
            for _ in range(iterations):
                if solved():
                    break
                velocity = mink.solve_ik(configuration, tasks, 1.0, solver="daqp", limits=limits)
                configuration.integrate_inplace(velocity, 1.0)
            return SolverOutput(configuration.q.copy(), solved())

        return solve

    return ask
