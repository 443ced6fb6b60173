"""Plumbob's own solvers, through their public interface, on the model that its readers make."""

from functools import partial
from typing import Any

from plumbob.reference import IKSolution, Outcome, Target, all_solutions, rotation, solve_ik
from plumbob.reference.formats import mjcf, urdf

from .protocol import Ask, BenchRobot, FloatArray, PoseRequest, Solve, Tolerance


def prepare(
    robot: BenchRobot,
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

    def ask(request: PoseRequest) -> Solve:
        x, R, start = request
        quaternions = rotation.from_matrix(R) if robot.oriented else [None] * len(x)
        targets = [*map(Target, x, quaternions, robot.effectors)]

        return Solve(partial(solve_ik, articulation, start, targets, **settings), _read)

    return ask


def prepare_all(robot: BenchRobot) -> Ask:
    """Return the solver of all solutions, set up for a chain."""
    articulation = urdf.parse(robot.text).articulation

    def ask(request: PoseRequest) -> Solve:
        target = Target(request.positions[0], rotation.from_matrix(request.rotations[0]))
        return Solve(partial(all_solutions, articulation, target), lambda s: (s.coordinates, None))

    return ask


def _read(solution: IKSolution) -> tuple[FloatArray | None, bool]:
    return solution.coordinates, solution.outcome == Outcome.CONVERGED
