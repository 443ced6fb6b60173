"""Drake: inverse kinematics as a nonlinear program, solved by a solver of its wheel.

Nothing is minimised: effectors are constrained to a box and a cone about their targets, coordinates
to their limits. The program stands once for a robot; frames in the world are moved to the targets.
Solvers stop at the edge of what is allowed, so half of the tolerance is asked for. Drake bounds an
angle by 2 (1 - cos angle), which at 1e-3 is as small as SNOPT's usual tolerance on constraints of
1e-6: a smaller one is given, or half of its claims are false.
"""

import logging
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame
from pydrake.solvers import IpoptSolver, SnoptSolver, SolverOptions

from .protocol import Ask, FloatArray, Forward, Robot, Solve, SolverOutput, Tolerance

# The part of the tolerance that is asked for.
INSIDE = 0.5
FEASIBILITY = 1e-8


class _Solver(NamedTuple):
    """A solver, and what it calls its tolerance on constraints and its most iterations."""

    kind: Any
    feasibility: str
    iterations: str


SOLVERS = {
    "SNOPT": _Solver(SnoptSolver, "Major feasibility tolerance", "Major iterations limit"),
    "IPOPT": _Solver(IpoptSolver, "constr_viol_tol", "max_iter"),
}


def prepare(
    robot: Robot, tolerance: Tolerance, solver: str = "SNOPT", iterations: int = 200
) -> Ask:
    """Return the program, set up for a robot."""
    logging.getLogger("drake").setLevel(logging.ERROR)  # IPOPT gives advice at each failure
    plant, frames = drake_plant(robot)
    ik, coordinates = _program(robot, plant, frames, tolerance), _Coordinates(robot, plant)
    engine, options = SOLVERS[solver].kind(), SolverOptions()
    options.SetOption(engine.solver_id(), SOLVERS[solver].feasibility, FEASIBILITY)
    options.SetOption(engine.solver_id(), SOLVERS[solver].iterations, iterations)
    context, program, unknowns = ik.get_mutable_context(), ik.prog(), ik.q()

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        targets = [
            RigidTransform(RotationMatrix(R), x)
            for R, x in zip(rotations, positions, strict=True)
        ]  # fmt: skip
        first = coordinates.to_drake(start)

        def solve() -> SolverOutput:
            for frame, target in zip(frames, targets, strict=True):
                frame.SetPoseInParentFrame(context, target)
            found = engine.Solve(program, first, options)
            q = coordinates.from_drake(found.GetSolution(unknowns))
            return SolverOutput(q, bool(found.is_success()))

        return solve

    return ask


def kinematics(robot: Robot) -> Forward:
    """Return Drake's forward kinematics of the effectors."""
    plant, _ = drake_plant(robot)
    context, coordinates = plant.CreateDefaultContext(), _Coordinates(robot, plant)
    frames = [plant.GetFrameByName(effector) for effector in robot.effectors]

    def forward(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        plant.SetPositions(context, coordinates.to_drake(q))
        poses = [frame.CalcPoseInWorld(context) for frame in frames]
        return (
            np.array([pose.translation() for pose in poses]),
            np.array([pose.rotation().matrix() for pose in poses]),
        )

    return forward


def drake_plant(robot: Robot) -> tuple[Any, list[Any]]:
    """Return the robot in Drake, its root fixed in the world, and a frame for each target."""
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


def _program(robot: Robot, plant: Any, targets: list[Any], tolerance: Tolerance) -> Any:
    """Return the program, whose positions are bounded in a cube within the ball of tolerance."""
    ik, straight = InverseKinematics(plant, True), RotationMatrix()
    side = np.full(3, INSIDE * tolerance.position / np.sqrt(3.0))
    for effector, target in zip(map(plant.GetFrameByName, robot.effectors), targets, strict=True):
        ik.AddPositionConstraint(effector, np.zeros(3), target, -side, side)
        if robot.oriented:
            angle = INSIDE * tolerance.rotation
            ik.AddOrientationConstraint(target, straight, effector, straight, angle)
    return ik


class _Coordinates:
    """Our coordinates and Drake's, which has roll, pitch and yaw for a ball."""

    def __init__(self, robot: Robot, plant: Any) -> None:
        """Find where each joint's coordinates stand in ours and in Drake's."""
        self._ours, self._theirs = len(robot.lower), plant.num_positions()
        at, places = 0, list[tuple[int, int]]
        self._hinges, self._balls = places(), places()
        for name in robot.joints:
            there = plant.GetJointByName(name).position_start()
            (self._balls if at in robot.balls else self._hinges).append((at, there))
            at += 4 if at in robot.balls else 1

    def to_drake(self, q: FloatArray) -> FloatArray:
        there = np.zeros(self._theirs)
        for ours, theirs in self._hinges:
            there[theirs] = q[ours]
        for ours, theirs in self._balls:
            quaternion = Quaternion(q[ours : ours + 4] / np.linalg.norm(q[ours : ours + 4]))
            there[theirs : theirs + 3] = RollPitchYaw(quaternion).vector()
        return there

    def from_drake(self, there: FloatArray) -> FloatArray:
        q = np.zeros(self._ours)
        for ours, theirs in self._hinges:
            q[ours] = there[theirs]
        for ours, theirs in self._balls:
            q[ours : ours + 4] = RollPitchYaw(there[theirs : theirs + 3]).ToQuaternion().wxyz()
        return q
