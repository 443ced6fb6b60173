"""Robotics Toolbox: its compiled Levenberg-Marquardt `ik_LM` and its relatives, with restarts.

Its `tol` bounds half the squared error, positions and angles together, so the default of 1e-6 lets
1.4e-3 pass. We give the equivalent of our tolerance. The chain is put together from the same file.
"""

import warnings
from functools import partial
from typing import Any

import numpy as np

from ...problems.robots import links
from ..peer import ONE_START, PORTFOLIO, RESTARTS, Peer, Run
from ..protocol import BenchRobot, PoseRequest, Solve, SolveFactory, Tolerance

# The search found no better damping on the tuning robots (docs/peers/robotics_toolbox.md).
_DAMPING = {"damping": "chan", "factor": 0.1}
PEER = Peer(
    "Robotics Toolbox ik_LM",
    __name__,
    "roboticstoolbox-python",
    "MIT",
    "Levenberg-Marquardt with random searches",
    "poses and limits of one chain of hinges",
    (
        # As the search chose: 1.5 points more solved than by the 30 iterations of its authors.
        Run(ONE_START, {"searches": 1, "iterations": 1000, "damping": "chan", "factor": 0.01}),
        Run(PORTFOLIO, {"searches": 8, "iterations": 12, **_DAMPING}, "8 searches of 12"),
        Run(RESTARTS, {"searches": 100, "iterations": 30, **_DAMPING}, "100 searches"),
    ),
    use="one arm in Python",
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    method: str = "LM",
    damping: str = "chan",
    factor: float = 0.1,
    searches: int = 100,
    iterations: int = 30,
    limits: bool = True,
) -> SolveFactory:
    """Return the solver, set up for a robot.

    `method` is NR, GN or LM, the last with a rule of damping and its factor.
    """
    robot.require_chain()
    chain = chain_of_transforms(robot)
    options: dict[str, Any] = {"ilimit": iterations, "slimit": searches, "joint_limits": limits}
    # Half the square of an error at the tolerance in both position and rotation.
    options["tol"] = 0.5 * min(tolerance) ** 2
    if method == "LM":
        options |= {"method": damping, "k": factor}
    run: Any = {"LM": chain.ik_LM, "NR": chain.ik_NR, "GN": chain.ik_GN}[method]

    def make_solve(request: PoseRequest) -> Solve:
        solve = partial(run, request.matrix, q0=request.start, **options)
        return Solve(solve, lambda solution: (solution.q, bool(solution.success)))

    return make_solve


def chain_of_transforms(robot: BenchRobot) -> Any:
    """Return the robot as elementary transforms: each hinge in a frame with its axis for z."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from roboticstoolbox.ets.ET import ET
        from roboticstoolbox.ets.ETS import ETS

    steps, pending, joint = [], np.eye(4), 0
    for transform, axis in links(robot):
        pending = pending @ transform
        if axis is None:
            continue
        across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        across /= np.linalg.norm(across)
        frame = np.eye(4)
        frame[:3, :3] = np.column_stack([across, np.cross(axis, across), axis])
        bounds = [robot.lower[joint], robot.upper[joint]]
        steps += [ET.SE3(pending @ frame), ET.Rz(qlim=bounds)]
        pending, joint = frame.T, joint + 1
    return ETS([*steps, ET.SE3(pending)])
