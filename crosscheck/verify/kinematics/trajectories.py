"""The frames of a robot's motion: errors, displacements of targets, jumps."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference import Target, rotation, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.reference.skeleton import Pose

from ..case import Case
from .robot_models import mechanism, tool_pose
from .robot_motions import ITERATIONS

# A frame is a jump if the joints move so many times as far as the reference has to from the same
# frame, and this much farther [rad]: solvers that weight joints, or move in the null space, may.
# Beyond reach the arm is singular, and an honest arm may turn about itself.
JUMP_FACTOR, JUMP_MARGIN, MARGIN_BEYOND_REACH = 5.0, 1.0, 5.0


def twists_between(start: Pose, end: Pose) -> FloatArray:
    """Return displacements [m] and rotation vectors [rad] from poses to others, (..., 6)."""
    turns = rotation.multiply(end.rotations, rotation.conjugate(start.rotations))
    shifts = end.positions - start.positions
    return np.concatenate([shifts, rotation.logarithm(turns)], axis=-1)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The coordinates of all frames, and where they take the tool."""

    case: Case
    q: FloatArray  # (frame, joint)

    @property
    def inputs(self) -> Mapping[str, Any]:
        """The request."""
        return self.case.inputs

    @cached_property
    def previous(self) -> FloatArray:
        """The coordinates in the frame before, (frame, joint)."""
        return np.concatenate([self.inputs["start"][None], self.q[:-1]])

    @cached_property
    def changes(self) -> FloatArray:
        """How far the joints move from the frame before, (frame, joint)."""
        return self.q - self.previous

    @cached_property
    def jacobians(self) -> FloatArray:
        """The tool's Jacobians in the frames before, along the axes of the world."""
        return jacobian(mechanism(self.inputs), self.previous, -1)

    def targets(self, shift: int = 0) -> Pose:
        """Return the targets of all frames, or of those so much later; the ends are repeated."""
        rows = np.clip(np.arange(len(self.q)) + shift, 0, len(self.q) - 1)
        return Pose(self.inputs["target_positions"][rows], self.inputs["target_rotations"][rows])

    def twists(self, q: FloatArray, shift: int = 0) -> FloatArray:
        """Return the twists from the tool at q, (frame, joint), to the targets, (frame, 6)."""
        return twists_between(tool_pose(self.inputs, q), self.targets(shift))

    def errors(self, twists: FloatArray) -> FloatArray:
        """Return the larger of both parts of twists, in tolerances."""
        position, angle = np.linalg.norm(twists.reshape(-1, 2, 3), axis=-1).T
        return np.maximum(position / self.inputs["tolerance"],
                          angle / self.inputs["tolerance_rotation"])  # fmt: skip

    @cached_property
    def displacements(self) -> FloatArray:
        """The twists of the targets from the frame before, in the first from the start."""
        twists = twists_between(self.targets(-1), self.targets())
        twists[0] = self.twists(self.previous)[0]
        return twists

    @cached_property
    def least_changes(self) -> FloatArray:
        """How far the reference moves the joints from the frame before to the target, (frame)."""
        within = np.clip(self.previous, self.inputs["lower"], self.inputs["upper"])
        solution = solve_ik(
            mechanism(self.inputs), within, Target(*self.targets(), -1), "levenberg_marquardt",
            restarts=0, max_iterations=ITERATIONS, tolerance=self.inputs["tolerance"],
            tolerance_rotation=self.inputs["tolerance_rotation"],
        )  # fmt: skip
        return np.linalg.norm(solution.coordinates - self.previous, axis=-1)

    @cached_property
    def jumps(self) -> FloatArray:
        """How far the joints move, in multiples of the least that is a jump, (frame)."""
        is_reachable = self.case.facts["reachable"]
        limits = JUMP_FACTOR * np.where(is_reachable, self.least_changes, 0.0)
        limits += np.where(is_reachable, JUMP_MARGIN, MARGIN_BEYOND_REACH)
        return np.linalg.norm(self.changes, axis=-1) / limits

    @cached_property
    def excess(self) -> FloatArray:
        """How far coordinates are beyond their limits, (frame, joint)."""
        lower, upper = self.inputs["lower"], self.inputs["upper"]
        return np.maximum(np.maximum(lower - self.q, self.q - upper), 0.0)
