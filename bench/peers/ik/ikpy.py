"""ikpy: SciPy's least squares over the chain's transforms, within its limits.

ikpy solves for the last link of a chain, which is the effector here, and reports no success.
"""

import warnings
from functools import partial
from typing import Any

import numpy as np

from ..peer import ONE_START, Peer, Run
from ..protocol import BenchRobot, PoseRequest, Solve, SolveFactory, Tolerance

PEER = Peer(
    "ikpy",
    __name__,
    "ikpy",
    "Apache-2.0",
    "SciPy's least squares within bounds",
    "poses and limits of one chain of hinges; makes no claims",
    # Its own optimizer with SciPy's tolerances: the search found nothing better.
    (Run(ONE_START, {"optimizer": "least_squares", "precision": 0.0, "method": ""}),),
    use="plain Python, no engine",
)


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    optimizer: str = "least_squares",
    precision: float = 0.0,
    method: str = "",
) -> SolveFactory:
    """Return the solver, set up for a robot; there is no tolerance on poses.

    `precision` is the precision of its optimizer, if any, `method` a method of the optimizer in
    SciPy.
    """
    import ikpy.chain

    robot.require_chain()
    with robot.file() as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        chain = ikpy.chain.Chain.from_urdf_file(file, base_elements=[robot.root])
        moving = np.array([link.name in robot.joints for link in chain.links])
        chain.active_links_mask = moving
    options: dict[str, Any] = {"optimizer": optimizer, "tol": precision or None}
    options |= {"optimizer_kwargs": {"method": method}} if method else {}

    def make_solve(request: PoseRequest) -> Solve:
        target, q0 = (request.positions[0], request.rotations[0], "all"), np.zeros(len(moving))
        q0[moving] = request.start

        solve = partial(chain.inverse_kinematics, *target, initial_position=q0, **options)
        return Solve(solve, lambda q: (q[moving], None))

    return make_solve
