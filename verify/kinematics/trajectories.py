"""The frames of a robot's motion, or its one answer: errors, displacements of targets, jumps."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference import Target, solve_ik
from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.reference.skeleton import Pose

from ..case import Case
from ..exchange import Answer, Exchange
from ..judgement import CaseJudgement, Finding
from ..laws import finding
from .robot_models import FARTHEST, ancestors, mechanism, tool_pose, twists_between
from .robot_motions import ITERATIONS
from .robot_targets import LIMIT_STEP

# A frame is a jump if the joints move so many times as far as the reference from the same frame,
# and this much farther [rad]. Weighted joints and motions in the null space stay below. Beyond
# reach the arm is singular, and an honest arm may turn about itself.
JUMP_FACTOR, JUMP_MARGIN, MARGIN_BEYOND_REACH = 5.0, 1.0, 5.0
# Answers of a faulty solver may stop so many times as far off as its tolerance: it has its own.
LENIENT = 10.0
# Joints so close to a limit are at this limit [rad].
AT_LIMIT = 1e-6
# Newton iterations of joints beyond their limits; joints enough for any target.
RELEASES, ENOUGH_JOINTS = 10, 6
# Joints that a solver has clamped leave their limits so far [rad, m]: what is left of slow
# iterations is less.
RELEASED = 0.03


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The coordinates of all frames, and where they take the tool."""

    case: Case
    q: FloatArray  # (frame, joint)
    is_claimed: bool | None = None  # whether the solver reports success, if it does
    velocities: FloatArray | None = None  # that the solver reports, (frame, joint)

    @property
    def is_pose(self) -> bool:
        """Whether it is the answer to a single target."""
        return "target_position" in self.inputs

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
        names = ["target_position", "target_rotation"]
        if self.is_pose:
            return Pose(*(self.inputs[name][None] for name in names))
        rows = np.clip(np.arange(len(self.q)) + shift, 0, len(self.q) - 1)
        return Pose(*(self.inputs[f"{name}s"][rows] for name in names))

    def twists(self, q: FloatArray, shift: int = 0) -> FloatArray:
        """Return the twists from the tool at q, (frame, joint), to the targets, (frame, 6)."""
        return twists_between(tool_pose(self.inputs, q), self.targets(shift))

    def errors(self, twists: FloatArray) -> FloatArray:
        """Return the larger of both parts of twists, in tolerances."""
        position, angle = np.linalg.norm(twists.reshape(-1, 2, 3), axis=-1).T
        return np.maximum(position / self.inputs["tolerance"],
                          angle / self.inputs["tolerance_rotation"])  # fmt: skip

    @cached_property
    def is_off_target(self) -> BoolArray:
        """Whether the tool is off its target, (frame)."""
        return self.errors(self.twists(self.q)) > LENIENT

    @property
    def is_missed(self) -> BoolArray:
        """Whether the tool is off a reachable target, (frame)."""
        return np.asarray(self.is_off_target & self.case.facts["reachable"])

    @cached_property
    def at_limits(self) -> BoolArray:
        """Whether joints are at their limits or beyond, (frame, joint)."""
        lower, upper = self.inputs["lower"], self.inputs["upper"]
        return np.asarray((self.q >= upper - AT_LIMIT) | (self.q <= lower + AT_LIMIT))

    @cached_property
    def is_clamped(self) -> BoolArray:
        """Whether the tool is brought to a missed target by the joints at limits alone, (frame)."""
        q, is_held = self.q.copy(), self.at_limits
        is_held = is_held & self.is_missed[:, None]
        is_held &= (is_held.sum(axis=-1) < min(ENOUGH_JOINTS, q.shape[1]))[:, None]
        robot = mechanism(self.inputs)
        for _ in range(RELEASES if is_held.any() else 0):
            J = jacobian(robot, q, -1) * is_held[:, None, :]
            q += np.einsum("fji,fi->fj", np.linalg.pinv(J), self.twists(q))
        is_beyond = np.abs(q - self.q).max(axis=-1) > RELEASED
        return np.asarray(is_beyond & (self.errors(self.twists(q)) <= LENIENT))

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
        if self.is_pose:
            return np.zeros(len(self.q))
        limits = JUMP_FACTOR * np.where(is_reachable, self.least_changes, 0.0)
        limits += np.where(is_reachable, JUMP_MARGIN, MARGIN_BEYOND_REACH)
        return np.linalg.norm(self.changes, axis=-1) / limits

    @cached_property
    def excess(self) -> FloatArray:
        """How far coordinates are beyond their limits, (frame, joint)."""
        lower, upper = self.inputs["lower"], self.inputs["upper"]
        return np.maximum(np.maximum(lower - self.q, self.q - upper), 0.0)


def trajectory_of(case: Case, outputs: Mapping[str, Any]) -> Trajectory:
    """Return an answer as a motion, that to a single target as a motion of one frame."""
    q = np.reshape(outputs["q"], (-1, len(case.inputs["start"])))
    claim = outputs.get("converged")
    is_claimed = None if claim is None else bool(claim)
    return Trajectory(case, np.clip(q, -FARTHEST, FARTHEST), is_claimed, outputs.get("velocities"))


def trajectories(answers: Iterable[Exchange | CaseJudgement]) -> dict[str, Trajectory]:
    """Return the motions of answers with finite coordinates, by the names of cases."""
    return {
        answer.case.name: trajectory_of(answer.case, answer.answer.values)
        for answer in answers
        if isinstance(answer.answer, Answer)
        and np.isfinite(answer.answer.values.get("q", np.nan)).all()
    }


def is_falling_at(motion: Trajectory) -> bool:
    """Return whether the error of a pose has fallen from the start and can fall further."""
    before, after = (np.linalg.norm(motion.twists(q), axis=-1) for q in (motion.previous, motion.q))
    return bool(((after < REDUCED * before) & ~is_at_minimum(motion)).any())


def limit_laws(motion: Trajectory, motions: Iterable[Trajectory]) -> Iterator[Finding]:
    """Yield whether a single iteration from a joint's limit moves the due joints.

    The joint has to stay in all motions: a single clamp may be by chance.
    """
    facts = motion.case.facts
    if motion.case.family != LIMIT_STEP or is_still(motion).all():
        return
    stays = [is_still(other)[other.case.facts["held"]] for other in motions
             if other.case.family == LIMIT_STEP and other.case.facts["is_leaving"]]  # fmt: skip
    yield finding("steps at limits", facts["is_leaving"] and all(stays), index=facts["held"])
    is_other = is_still(motion) & (ancestors(motion.inputs) > 0.0)
    other_joints = np.setdiff1d(np.flatnonzero(is_other), facts["held"])
    yield finding("steps at limits, others", len(other_joints), index=facts["held"],
                  others=", ".join(map(str, other_joints)))  # fmt: skip


def is_still(motion: Trajectory) -> BoolArray:
    """Return whether joints stay in the first frame, (joint)."""
    return np.asarray(np.abs(motion.changes[0]) <= EXACT)


# Errors that fall to less than this share have been reduced.
REDUCED = 0.9


# Coordinates at a limit are so near to the limit [rad, m]; speeds agree to this share.
EXACT, SAME_SPEED = 1e-9, 1e-3


def is_at_minimum(motion: Trajectory) -> BoolArray:
    """Return whether no joint off its limits would reduce the error, (frame).

    Solvers choose weights of rotations: some weight may make this residual the least.
    """
    e, J = motion.twists(motion.q), jacobian(mechanism(motion.inputs), motion.q, -1)
    J = J * ~motion.at_limits[:, None, :]
    linear, angular = (
        np.einsum("fij,fi->fj", J[:, part], e[:, part]) for part in (slice(3), slice(3, 6))
    )
    lengths = np.maximum((angular * angular).sum(axis=-1), 1e-300)
    balance = np.clip(-(linear * angular).sum(axis=-1) / lengths, *SQUARED_WEIGHTS)
    is_least = np.zeros(len(e), dtype=bool)
    for square in (np.ones(len(e)), balance):
        rows = np.repeat(np.stack([np.ones(len(e)), np.sqrt(square)], axis=-1), 3, axis=-1)
        gradient = np.linalg.norm(linear + square[:, None] * angular, axis=-1)
        size = np.linalg.norm(J * rows[..., None], axis=(1, 2))
        is_least |= gradient <= STATIONARY * size * np.linalg.norm(e * rows, axis=-1)
    return is_least


# An error is least where its gradient is this small, relative to error and Jacobian.
STATIONARY = 0.01


# The squares of the weights that solvers give rotations [m^2].
SQUARED_WEIGHTS = (1e-3, 1e2)
