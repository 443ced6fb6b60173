"""pytorch_kinematics: `PseudoInverseIK`, damped least squares on tensors, on a single processor.

In the end it takes off whole revolutions, clamps to the limits, and corrects the resulting error.
It starts from as many configurations at once as it is given. In single precision, its default, some
targets end in a singular matrix; here it works in double precision.
"""

from typing import Any

import numpy as np
import pytorch_kinematics
import torch

from .protocol import Ask, BenchRobot, FloatArray, Forward, PoseRequest, Solve, Tolerance
from .restarts import generator_of


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    iterations: int = 50,
    attempts: int = 1,
    damping: float = 0.1,
    patience: int = 2,
    clamp: bool = False,
) -> Ask:
    """Return the solver, set up for a robot; attempts beyond the first start anywhere.

    It ends after `patience` iterations without progress, and may clamp each step to the limits.
    """
    chain = torch_chain(robot)
    torch.set_num_threads(1)
    solver = pytorch_kinematics.PseudoInverseIK(
        chain,
        pos_tolerance=tolerance.position,
        rot_tolerance=tolerance.rotation,
        retry_configs=torch.zeros(attempts, len(robot.lower), dtype=torch.float64),
        max_iterations=iterations,
        early_stopping_any_converged=True,
        early_stopping_no_improvement_patience=patience,
        lm_damping=damping,
        clamp_to_limits=clamp,
    )

    def ask(request: PoseRequest) -> Solve:
        rotation, position = (torch.tensor(a[:1]) for a in (request.rotations, request.positions))
        target = pytorch_kinematics.Transform3d(rot=rotation, pos=position, dtype=torch.float64)
        poses = robot.draw(generator_of(*request), attempts - 1)
        starts = torch.tensor(np.vstack([request.start, poses]))

        def solve() -> Any:
            solver.initial_config = starts
            return solver.solve(target)

        return Solve(solve, _read)

    return ask


def _read(output: Any) -> tuple[FloatArray, bool]:
    best = int(output.converged[0].int().argmax())
    return output.solutions[0, best].numpy(), bool(output.converged_any[0])


def kinematics(robot: BenchRobot) -> Forward:
    """Return the forward kinematics of the effector."""
    chain = torch_chain(robot)
    return lambda q: chain.forward_kinematics(torch.tensor(q)).get_matrix()[0].numpy()


def torch_chain(robot: BenchRobot) -> pytorch_kinematics.SerialChain:
    """Return a chain in double precision.

    Raises:
        UnableError: if the robot is no chain.
        ValueError: if its joints are ordered otherwise.
    """
    robot.require_chain()
    chain = pytorch_kinematics.build_serial_chain_from_urdf(
        robot.text.encode(), robot.effectors[0], robot.root
    )
    robot.check_order("pytorch_kinematics", chain.get_joint_parameter_names())
    return chain.to(dtype=torch.float64)
