"""pytorch_kinematics: `PseudoInverseIK`, damped least squares on tensors, on one processor.

In the end it takes off whole revolutions, clamps to the limits, and corrects what that has spoilt.
It starts from as many configurations at once as it is given. In single precision, its default, some
targets end in a singular matrix; here it works in double precision.
"""

import numpy as np
import pytorch_kinematics
import torch

from .protocol import Ask, FloatArray, Forward, Robot, Solve, SolverOutput, Tolerance, needs_a_chain
from .restarts import generator_of


def prepare(robot: Robot, tolerance: Tolerance, iterations: int = 50, attempts: int = 1) -> Ask:
    """Return the solver, set up for a robot; attempts beyond the first start anywhere."""
    needs_a_chain(robot)
    torch.set_num_threads(1)
    chain = torch_chain(robot)
    solver = pytorch_kinematics.PseudoInverseIK(
        chain,
        pos_tolerance=tolerance.position,
        rot_tolerance=tolerance.rotation,
        retry_configs=torch.zeros(attempts, len(robot.lower), dtype=torch.float64),
        max_iterations=iterations,
        early_stopping_any_converged=True,
    )

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        target = pytorch_kinematics.Transform3d(
            rot=torch.tensor(rotations[:1]), pos=torch.tensor(positions[:1]), dtype=torch.float64
        )
        others = robot.draw(generator_of(positions, rotations, start), attempts - 1)
        starts = torch.tensor(np.vstack([start, others]))

        def solve() -> SolverOutput:
            solver.initial_config = starts
            found = solver.solve(target)
            best = int(found.converged[0].int().argmax())
            return SolverOutput(found.solutions[0, best].numpy(), bool(found.converged_any[0]))

        return solve

    return ask


def kinematics(robot: Robot) -> Forward:
    """Return the forward kinematics of the effector."""
    needs_a_chain(robot)
    chain = torch_chain(robot)

    def forward(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        T = chain.forward_kinematics(torch.tensor(q)).get_matrix().numpy()
        return T[:, :3, 3], T[:, :3, :3]

    return forward


def torch_chain(robot: Robot) -> pytorch_kinematics.SerialChain:
    """Return a chain in double precision, its joints in the robot's order.

    Raises:
        ValueError: if they are ordered otherwise.
    """
    chain = pytorch_kinematics.build_serial_chain_from_urdf(
        robot.text.encode(), robot.effectors[0], robot.root
    )
    names = tuple(chain.get_joint_parameter_names())
    if names != robot.joints:
        raise ValueError(f"pytorch_kinematics orders the joints as {', '.join(names)}")
    return chain.to(dtype=torch.float64)
