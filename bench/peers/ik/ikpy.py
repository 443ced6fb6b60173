"""ikpy: SciPy's least squares over the chain's transforms, within its limits.

It solves for the last link of a chain, which is the effector here, and does not say whether it did.
"""

import warnings

import ikpy.chain
import numpy as np

from .protocol import (
    Ask,
    FloatArray,
    Robot,
    Solve,
    SolverOutput,
    Tolerance,
    needs_a_chain,
    robot_file,
)


def prepare(robot: Robot, tolerance: Tolerance) -> Ask:
    """Return the solver, set up for a robot; it takes no tolerance."""
    needs_a_chain(robot)
    with robot_file(robot) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        chain = ikpy.chain.Chain.from_urdf_file(file, base_elements=[robot.root])
        moving = np.array([link.name in robot.joints for link in chain.links])
        chain.active_links_mask = moving

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        target, first = (positions[0], rotations[0], "all"), np.zeros(len(moving))
        first[moving] = start

        def solve() -> SolverOutput:
            q = chain.inverse_kinematics(*target, initial_position=first)
            return SolverOutput(q[moving], None)

        return solve

    return ask
