"""Plumbob's own solvers, through their public interface, on what its readers make of the text."""

from typing import Any

from plumbob.reference import Outcome, Target, rotation, solve_ik
from plumbob.reference.formats import mjcf, urdf

from .protocol import Ask, FloatArray, Robot, Solve, SolverOutput, Tolerance


def prepare(
    robot: Robot,
    tolerance: Tolerance,
    solver: str = "levenberg_marquardt",
    restarts: int = 0,
    iterations: int = 200,
) -> Ask:
    """Return the solver, set up for a robot."""
    read = urdf.parse if robot.is_chain else mjcf.parse
    articulation = read(robot.text).articulation
    settings: dict[str, Any] = {"solver": solver, "restarts": restarts}
    settings |= {"max_iterations": iterations, "tolerance": tolerance.position}
    settings |= {"tolerance_rotation": tolerance.rotation}

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        quaternions = rotation.from_matrix(rotations) if robot.oriented else [None] * len(positions)
        targets = [*map(Target, positions, quaternions, robot.effectors)]

        def solve() -> SolverOutput:
            solution = solve_ik(articulation, start, targets, **settings)
            return SolverOutput(solution.coordinates, solution.outcome == Outcome.CONVERGED)

        return solve

    return ask
