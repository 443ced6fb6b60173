"""ikpy: SciPy's least squares over the chain's transforms, within its limits.

It solves for the last link of a chain, which is the effector here, and does not say whether it did.
"""

import tempfile
import warnings
from pathlib import Path

import ikpy.chain
import numpy as np

from plumbob.reference.arguments import FloatArray

from ...experiments.robots.evaluate import Tolerance
from ...experiments.robots.problem import Robot
from .protocol import Ask, Solve, SolverOutput, needs_a_chain


def prepare(robot: Robot, tolerance: Tolerance) -> Ask:
    """Return the solver, set up for a robot; it takes no tolerance."""
    needs_a_chain(robot)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = Path(folder) / "robot.urdf"
        file.write_text(robot.text, encoding="utf-8")
        chain = ikpy.chain.Chain.from_urdf_file(str(file), base_elements=[robot.root])
        moving = np.array([link.name in robot.joints for link in chain.links])
        chain.active_links_mask = moving

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        first = np.zeros(len(moving))
        first[moving] = start

        def solve() -> SolverOutput:
            found = chain.inverse_kinematics(
                positions[0], rotations[0], "all", initial_position=first
            )
            return SolverOutput(found[moving], None)

        return solve

    return ask
