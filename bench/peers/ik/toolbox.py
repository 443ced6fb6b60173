"""Robotics Toolbox: its compiled Levenberg-Marquardt `ik_LM` and its relatives, with restarts.

Its `tol` bounds half the squared error, positions and angles together, so the default of 1e-6 lets
1.4e-3 pass; we give what stands for our tolerance. The chain is put together from the same file.
"""

import warnings
from typing import Any

import numpy as np

from ...problems.robots import links
from .protocol import (
    Ask,
    FloatArray,
    Robot,
    Solve,
    SolverOutput,
    Tolerance,
    needs_a_chain,
    pose_matrix,
)

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from roboticstoolbox.ets.ET import ET
    from roboticstoolbox.ets.ETS import ETS

# Half the square of an error that meets the tolerance in position and in rotation alike.
HALF = 0.5


def prepare(
    robot: Robot,
    tolerance: Tolerance,
    method: str = "LM",
    damping: str = "chan",
    factor: float = 0.1,
    searches: int = 100,
    iterations: int = 30,
    limits: bool = True,
) -> Ask:
    """Return the solver, set up for a robot.

    `method` is NR, GN or LM, the last with a rule of damping and its factor.
    """
    needs_a_chain(robot)
    chain = chain_of_transforms(robot)
    shared: dict[str, Any] = {
        "ilimit": iterations,
        "slimit": searches,
        "joint_limits": limits,
        "tol": HALF * min(tolerance) ** 2,
    }
    run: Any = {"LM": chain.ik_LM, "NR": chain.ik_NR, "GN": chain.ik_GN}[method]
    if method == "LM":
        shared |= {"method": damping, "k": factor}

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        target = pose_matrix(positions[0], rotations[0])

        def solve() -> SolverOutput:
            solution = run(target, q0=start, **shared)
            return SolverOutput(solution.q, bool(solution.success))

        return solve

    return ask


def chain_of_transforms(robot: Robot) -> ETS:
    """Return the robot as elementary transforms: each hinge in a frame whose z is its axis."""
    steps, ahead, joint = [], np.eye(4), 0
    for transform, axis in links(robot):
        ahead = ahead @ transform
        if axis is None:
            continue
        frame = np.eye(4)
        frame[:3, :3] = frame_with_z(axis)
        bounds = [robot.lower[joint], robot.upper[joint]]
        steps += [ET.SE3(ahead @ frame), ET.Rz(qlim=bounds)]
        ahead, joint = frame.T, joint + 1
    return ETS([*steps, ET.SE3(ahead)])


def frame_with_z(axis: FloatArray) -> FloatArray:
    """Return a rotation that takes z to the axis."""
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(axis, across), axis])
