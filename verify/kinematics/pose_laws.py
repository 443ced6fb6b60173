"""Laws of an answered pose: local rotations, positions, or both."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference import Skeleton, judge_pose, rotation
from plumbob.reference.arguments import FloatArray, IndexArray, distinct_texts
from plumbob.reference.judging import PoseJudgement

from ..case import Case
from ..greeting import Greeting
from ..judgement import Finding, Verdict
from ..laws import finding, not_finite, of_joints
from . import rounding
from .predictions import with_effector_of

# Below this share of the size, in single precision, rotations rounded to the identity separate
# positions from rotations: a dead angle a joint.
DEAD_JOINTS = 4.0
# Larger positions are clipped to this [m]: `judge_pose` takes none beyond 1e75.
FARTHEST = 1e74
# Below this share of the largest coordinate positions are those of the rotations, in single
# precision too.
AGREEMENT = 1e-4
# Coordinates beyond this share of the skeleton's size come from a division by nearly zero.
HUGE = 1e3


@dataclass(frozen=True, eq=False)
class AnsweredPose:
    """An answer as the laws read it."""

    path: IndexArray  # joints from the root to the effector
    raw: FloatArray | None  # local rotations as answered
    local: FloatArray | None  # the same, normalised, with `with_effector_of`
    answered_positions: FloatArray | None  # [m]
    positions: FloatArray  # of the joints, by the rotations if there are any [m]
    judgement: PoseJudgement | None  # None if numbers are missing

    @property
    def finite(self) -> bool:
        """Whether the joints of the path have positions."""
        return bool(np.isfinite(self.positions[self.path]).all())

    def is_huge(self, size: float) -> bool:
        """Return whether positions are far beyond a skeleton of this size [m]."""
        x = self.answered_positions
        return x is not None and float(np.abs(x).max()) > HUGE * size

    @cached_property
    def drift(self) -> float:
        """The largest error of a rotation's length."""
        if self.raw is None:
            return 0.0
        errors = np.abs(np.linalg.norm(self.raw, axis=-1) - 1.0)
        return float(np.nanmax(errors[self.path], initial=0.0))

    @property
    def outputs(self) -> Mapping[str, Any]:
        """The outputs to compare with variants, of all joints and of the path alone.

        Positions by the rotations say nothing of their own, and need not be a solver's last points.
        """
        outputs: dict[str, Any] = {}
        x = self.answered_positions
        if x is not None:
            if not self._agrees(slice(None)):
                outputs["positions"] = x
            if not self._agrees(self.path):
                outputs["path_positions"] = x[self.path]
        if self.local is not None:
            outputs |= {
                "local_rotations": self.local, "path_placed": self.positions[self.path]
            }  # fmt: skip
        return outputs

    def _agrees(self, joints: Any) -> bool:
        """Return whether answered positions of some joints are those of the rotations, nearly."""
        if self.local is None or self.answered_positions is None:
            return False
        gap = np.abs(self.positions - self.answered_positions)[joints]
        return bool(gap.max() <= AGREEMENT * np.abs(self.positions[joints]).max())

    @property
    def distance(self) -> float:
        """The effector's distance from its target [m]."""
        return np.inf if self.judgement is None else self.judgement.distance

    def distance_to(self, positions: FloatArray) -> float:
        """Return the largest difference of a coordinate of the path's joints [m]."""
        return float(np.abs(self.positions[self.path] - positions[self.path]).max())


def read_pose(
    outputs: Mapping[str, Any], inputs: Mapping[str, Any], facts: Mapping[str, Any]
) -> AnsweredPose:
    """Return an answer as the laws read it."""
    raw: FloatArray | None = outputs.get("local_rotations")
    given_positions: FloatArray | None = outputs.get("positions")
    path, local, rotations = facts["path"], None, None
    if raw is not None:
        local = with_effector_of(np.array(raw), inputs)
        with np.errstate(all="ignore"):  # zero length or infinite numbers give NaN
            local = local / np.linalg.norm(local, axis=-1, keepdims=True)
        usable = np.linalg.norm(local, axis=-1) > 0.5
        if usable[path[:-1]].all():  # the others do not move the path
            rotations = np.where(usable[:, None], local, inputs["local_rotations"])
    x = judgement = None
    if given_positions is not None and np.isfinite(given_positions).all():
        x = np.clip(given_positions, -FARTHEST, FARTHEST)
    if rotations is not None or x is not None:
        skeleton = Skeleton(inputs["parents"], inputs["offsets"])
        judgement = judge_pose(
            skeleton, rotations, inputs["target"], inputs["effector"], positions=x
        )
    positions = np.full(np.shape(inputs["offsets"]), np.nan)
    if local is None and given_positions is not None:
        positions = given_positions
    elif rotations is not None and judgement is not None:
        positions = judgement.positions
    return AnsweredPose(path, raw, local, given_positions, positions, judgement)


def all_of(pose: AnsweredPose, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings about a pose that do not depend on its target."""
    if not pose.outputs:
        return [finding("numbers, no pose")]
    return [*rotation_laws(pose, case, greeting), *position_laws(pose, case, greeting)]


def unit_quaternions(lengths: FloatArray, tolerance: float) -> Finding:
    """Return whether quaternions have unit length; other laws normalise them."""
    errors = np.abs(lengths - 1.0)
    joint = int(np.argmax(errors))
    length, _ = distinct_texts(lengths[joint], 1.0)
    return finding("unit quaternions", errors[joint], tolerance, index=joint, length=length)


def rotation_laws(pose: AnsweredPose, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings about local rotations: numbers, norms, joints off the path."""
    if pose.raw is None or pose.local is None:
        return []
    effector, bound = case.inputs["effector"], rounding.rotations(greeting.epsilon, len(pose.raw))
    lengths = np.linalg.norm(pose.raw, axis=-1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    findings, is_finite = list[Finding](), bool(np.isfinite(pose.local).all())
    if not usable.all():
        joint = int(np.argmin(usable))
        verdict = Verdict.RIGHT_EXCEPT if joint == effector and is_finite else None
        is_zero = lengths[joint] == 0.0
        key = "numbers, of a zero rotation" if is_zero else "numbers, of a local rotation"
        findings.append(finding(key, verdict=verdict, index=joint))
    if not is_finite:
        return findings
    lengths = np.where(usable, lengths, 1.0)
    if usable.any():
        drift = rounding.lengths(greeting.epsilon, len(pose.raw), _repetitions(case))
        findings.append(unit_quaternions(lengths, drift))
    start = case.inputs["local_rotations"]
    rotations = np.where(usable[:, None], pose.raw / lengths[:, None], start)
    angles = rotation.angle(rotations, start / np.linalg.norm(start, axis=-1, keepdims=True))
    angles[pose.path[:-1]] = 0.0
    joint, key = int(np.argmax(angles)), "joints off the path"
    key += ", the effector" if joint == effector else ""
    # programs that turn whole branches by hand return the quotient of two global rotations
    gathered = max(bound, min(bound * _repetitions(case), AGREEMENT))
    return [*findings, finding(key, angles[joint], gathered, index=joint)]


def position_laws(pose: AnsweredPose, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings about positions: numbers, root, link lengths, branches, rotations."""
    x = pose.answered_positions
    if x is None:
        return []
    bound = rounding.positions(greeting.epsilon, len(x), case.facts["size"], pose.drift)
    if not np.isfinite(x).all():
        with np.errstate(invalid="ignore"):  # infinities of both signs
            sums = x.sum(axis=-1)
        return [not_finite("numbers, of a joint", sums, bound)]
    parents, offsets = case.inputs["parents"], case.inputs["offsets"]
    assert pose.judgement is not None
    assert pose.judgement.length_errors is not None
    gathered = bound * _repetitions(case)
    # each joint of a path is rotated in each iteration
    length_bound = max(bound, min(gathered * len(x), AGREEMENT * case.facts["size"]))
    return [
        finding("root in place", float(np.linalg.norm(x[0] - offsets[0])), bound, index=0),
        of_joints("link lengths", pose.judgement.length_errors, length_bound),
        _branches(x, parents, offsets, 2.0 * length_bound),
        *_agreement(pose, case, 2.0 * gathered, greeting),
    ]


def _repetitions(case: Case) -> int:
    """Return how often a solver may rotate by hand: rounding gathers in each iteration."""
    return max(1, int(case.inputs["max_iterations"])) * len(case.inputs.get("curve", " "))


def _branches(x: FloatArray, parents: IndexArray, offsets: FloatArray, bound: float) -> Finding:
    """Return whether the children of a joint keep their distances, like a rigid body."""
    error, joint = 0.0, 0
    for j in range(2, len(parents)):
        for sibling in np.flatnonzero(parents[:j] == parents[j]):
            length = np.linalg.norm(offsets[j] - offsets[sibling])
            change = abs(float(np.linalg.norm(x[j] - x[sibling]) - length))
            if change > error:
                error, joint = change, j
    return finding("branches", error, bound, index=joint)


def _agreement(pose: AnsweredPose, case: Case, bound: float, greeting: Greeting) -> list[Finding]:
    """Return whether the positions agree with the rotations."""
    errors = None if pose.judgement is None else pose.judgement.position_errors
    carriers = case.inputs["parents"][1:]
    if errors is None or pose.local is None or not np.isfinite(pose.local[carriers]).all():
        return []
    dead = DEAD_JOINTS * rounding.DEAD_ANGLE[greeting.precision] * case.facts["reach"]
    verdict = Verdict.RIGHT_EXCEPT if errors.max() <= dead else None
    return [of_joints("rotations agree with positions", errors, bound, verdict)]


def claims(
    distance: float, slack: float, outputs: Mapping[str, Any], case: Case
) -> Iterator[Finding]:
    """Yield whether `converged`, `residual` and `iterations` are true."""
    tolerance, limit = case.inputs["tolerance"], case.inputs.get("max_iterations", np.inf)
    if (count := outputs.get("iterations", 0)) > limit:
        yield finding("claims, iterations", count - limit, count=count, limit=limit)
    if outputs.get("converged"):
        yield finding("claims, success", distance, tolerance + slack)
    elif "converged" in outputs and distance <= tolerance - slack:
        yield finding("claims, failure", tolerance - distance, distance=distance)
    if "residual" in outputs and np.isfinite(outputs["residual"]):
        error, bound = abs(outputs["residual"] - distance), slack + 1e-3 * distance
        claim, actual = distinct_texts(outputs["residual"], distance, 3)
        yield finding("claims, residual", error, bound, claimed=claim, distance=actual)
