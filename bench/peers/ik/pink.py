"""pink: differential inverse kinematics by quadratic programs, iterated to a target.

Each step asks for a part of the error (`gain`, over 1 s) within the joint limits. An effector
without a target rotation has no cost for it. Velocity limits are left out: there is no motion here.
With pink's own damping of 1e-12 the quadratic program is infeasible, and pink raises
`NoSolutionFound`, once a step leaves a joint 1e-7 beyond its limit; with 1e-6 it never is here.
"""

import logging

import pink

from .closed_loop import from_pinocchio, pinocchio_model, to_pinocchio
from .protocol import Ask, BenchRobot, PoseRequest, Solve, SolverOutput, Tolerance, arrived, iterate


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 200,
    damping: float = 1e-6,
    lm_damping: float = 0.0,
    gain: float = 1.0,
) -> Ask:
    """Return the solver, set up for a robot."""
    logging.getLogger().setLevel(logging.ERROR)  # it warns of each step beyond a limit
    model, cost = pinocchio_model(robot), float(robot.oriented)
    data, limits = model.createData(), [pink.limits.ConfigurationLimit(model)]
    tasks = [pink.FrameTask(effector, 1.0, cost, lm_damping, gain) for effector in robot.effectors]
    options = {"solver": "daqp", "damping": damping, "limits": limits, "safety_break": False}

    def ask(request: PoseRequest) -> Solve:
        targets = [pink.configuration.pin.SE3(R, x) for x, R in request.poses]
        q0 = to_pinocchio(robot, request.start)

        def solve() -> SolverOutput:
            for task, target in zip(tasks, targets, strict=True):
                task.set_target(target)
            configuration = pink.Configuration(model, data, q0)

            def step() -> None:
                velocity = pink.solve_ik(configuration, tasks, 1.0, **options)
                configuration.integrate_inplace(velocity, 1.0)

            def is_done() -> bool:
                errors = [task.compute_error(configuration) for task in tasks]
                return arrived(errors, robot, tolerance)

            claim = iterate(step, is_done, iterations)
            return SolverOutput(from_pinocchio(robot, configuration.q), claim)

        return solve

    return ask
