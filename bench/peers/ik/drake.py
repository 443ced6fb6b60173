"""Drake: inverse kinematics as a nonlinear program, solved by a solver of its wheel.

By default there is no objective. Effectors are constrained to a box and a cone about their targets,
coordinates to their limits. The program is built once for a robot; frames in the world are moved to
the targets. Solvers stop at the edge of the constraints, so a part of the tolerance is set. Drake
bounds an angle by 2 (1 - cos angle), which at 1e-3 is as small as SNOPT's usual tolerance on
constraints of 1e-6. A smaller tolerance is given, or half of its claims are false.
"""

import logging
from typing import Any

import numpy as np

from ...clock import library
from ..peer import ONE_START, Peer, Run, restarted, short_attempts
from ..protocol import BenchRobot, FloatArray, Forward, PoseRequest, Solve, SolveFactory, Tolerance

_SETTINGS = {"feasibility": 1e-8, "inside": 0.5, "centring": 0.0}
_SNOPT = {"solver": "SNOPT", **_SETTINGS}
PEER = Peer(
    "Drake",
    __name__,
    "drake",
    "BSD-3-Clause",
    "nonlinear programs by IPOPT (interior point) or SNOPT (SQP)",
    "poses, positions and limits of several effectors, balls, these by three angles",
    (
        # The search chose IPOPT (docs/peers/drake.md); SNOPT is what Drake chooses itself.
        Run(ONE_START, {"solver": "IPOPT", "iterations": 200, **_SETTINGS}, "IPOPT"),
        Run(ONE_START, {"iterations": 200, **_SNOPT}, "SNOPT"),
        # Twelve iterations of SNOPT arrive nowhere: the search chose two attempts of fifty.
        short_attempts(_SNOPT, "SNOPT, {}", count=2),
        restarted(50, _SNOPT, "SNOPT, {}"),
    ),
    use="constraints beside the pose",
)

METERED = True
# A solver, and its names for the tolerance on constraints and the maximum of iterations.
SOLVERS = {
    "SNOPT": ("SnoptSolver", "Major feasibility tolerance", "Major iterations limit"),
    "IPOPT": ("IpoptSolver", "constr_viol_tol", "max_iter"),
    "NLopt": ("NloptSolver", "constraint_tol", "max_eval"),
}


def prepare(
    robot: BenchRobot,
    tolerance: Tolerance,
    solver: str = "SNOPT",
    iterations: int = 200,
    feasibility: float = 1e-8,
    inside: float = 0.5,
    centring: float = 0.0,
) -> SolveFactory:
    """Return the nonlinear program of a pose, set up for a robot.

    Args:
        robot: a chain of hinges.
        tolerance: the bench's.
        solver: the name of the optimiser.
        iterations: at most.
        feasibility: tolerance of the optimiser on constraints.
        inside: the constraints allow this share of the bench's tolerance.
        centring: weight of the objective, the squared distance from the middle of the limits;
            0 for no objective.
    """
    from pydrake import solvers
    from pydrake.math import RigidTransform, RotationMatrix

    logging.getLogger("drake").setLevel(logging.ERROR)  # IPOPT gives advice at each failure
    plant, frames = drake_plant(robot)
    part = Tolerance(inside * tolerance.position, inside * tolerance.rotation)
    ik, coordinates = _program(robot, plant, frames, part, centring), _Coordinates(robot, plant)
    kind, feasibility_name, iterations_name = SOLVERS[solver]
    engine, options = getattr(solvers, kind)(), solvers.SolverOptions()
    options.SetOption(engine.solver_id(), feasibility_name, feasibility)
    options.SetOption(engine.solver_id(), iterations_name, iterations)
    context, program, run = ik.get_mutable_context(), ik.prog(), library(engine.Solve)
    setters = [library(frame.SetPoseInParentFrame) for frame in frames]

    def read(solution: Any) -> tuple[FloatArray, bool]:
        return coordinates.from_drake(solution.GetSolution(ik.q())), solution.is_success()

    def make_solve(request: PoseRequest) -> Solve:
        targets = [RigidTransform(RotationMatrix(R), x) for x, R in request.poses]
        q0 = coordinates.to_drake(request.start)

        def solve() -> Any:
            for set_target, target in zip(setters, targets, strict=True):
                set_target(context, target)
            return run(program, q0, options)

        return Solve(solve, read)

    return make_solve


def kinematics(robot: BenchRobot) -> Forward:
    """Return Drake's forward kinematics of the effectors."""
    plant = drake_plant(robot)[0]
    context, coordinates = plant.CreateDefaultContext(), _Coordinates(robot, plant)
    frames = [plant.GetFrameByName(effector) for effector in robot.effectors]

    def forward(q: FloatArray) -> FloatArray:
        plant.SetPositions(context, coordinates.to_drake(q))
        return np.array([frame.CalcPoseInWorld(context).GetAsMatrix4() for frame in frames])

    return forward


def drake_plant(robot: BenchRobot) -> tuple[Any, list[Any]]:
    """Return the robot in Drake, its root fixed in the world, and a frame for each target."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(robot.text, "urdf" if robot.is_chain else "xml")
    world = plant.world_frame()
    if robot.is_chain:
        plant.WeldFrames(world, plant.GetFrameByName(robot.root))
    frames = [
        plant.AddFrame(FixedOffsetFrame(f"target of {effector}", world, RigidTransform()))
        for effector in robot.effectors
    ]
    plant.Finalize()
    return plant, frames


def _program(
    robot: BenchRobot, plant: Any, targets: list[Any], tolerance: Tolerance, centring: float
) -> Any:
    """Return the program, with positions bounded in a cube within the ball of tolerance."""
    from pydrake.math import RotationMatrix
    from pydrake.multibody.inverse_kinematics import InverseKinematics

    ik, identity = InverseKinematics(plant, True), RotationMatrix()
    side = np.full(3, tolerance.position / np.sqrt(3.0))
    for effector, target in zip(map(plant.GetFrameByName, robot.effectors), targets, strict=True):
        ik.AddPositionConstraint(effector, np.zeros(3), target, -side, side)
        if robot.oriented:
            ik.AddOrientationConstraint(target, identity, effector, identity, tolerance.rotation)
    if centring:
        bounds = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
        middle = np.nan_to_num(np.mean(bounds, axis=0))  # balls have none
        ik.prog().AddQuadraticErrorCost(centring * np.eye(len(middle)), middle, ik.q())
    return ik


class _Coordinates:
    """The conversion to Drake's coordinates, which are roll, pitch and yaw for a ball."""

    def __init__(self, robot: BenchRobot, plant: Any) -> None:
        """Find the first coordinate of each joint in the robot and in Drake."""
        self._size, self._drake_size = len(robot.lower), plant.num_positions()
        self._hinges, self._balls = list[tuple[int, int]](), list[tuple[int, int]]()
        index = 0
        for name in robot.joints:
            offset = plant.GetJointByName(name).position_start()
            (self._balls if index in robot.balls else self._hinges).append((index, offset))
            index += 4 if index in robot.balls else 1

    def to_drake(self, q: FloatArray) -> FloatArray:
        from pydrake.common.eigen_geometry import Quaternion
        from pydrake.math import RollPitchYaw

        converted = np.zeros(self._drake_size)
        for index, offset in self._hinges:
            converted[offset] = q[index]
        for index, offset in self._balls:
            quaternion = Quaternion(q[index : index + 4] / np.linalg.norm(q[index : index + 4]))
            converted[offset : offset + 3] = RollPitchYaw(quaternion).vector()
        return converted

    def from_drake(self, converted: FloatArray) -> FloatArray:
        from pydrake.math import RollPitchYaw

        q = np.zeros(self._size)
        for index, offset in self._hinges:
            q[index] = converted[offset]
        for index, offset in self._balls:
            angles = RollPitchYaw(converted[offset : offset + 3])
            q[index : index + 4] = angles.ToQuaternion().wxyz()
        return q
