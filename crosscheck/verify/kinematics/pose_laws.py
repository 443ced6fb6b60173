"""Laws of a pose that a solver answers: local rotations, positions, or both."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference import Skeleton, judge_pose
from plumbob.reference.arguments import FloatArray, IndexArray
from plumbob.reference.judging import PoseJudgement

from ..case import Case
from ..greeting import Greeting
from ..judgement import Finding, Verdict
from ..sentence import sentence
from . import laws, rounding
from .predictions import with_effector_of

# Below this share of the size, in single precision, rotations that a helper rounds to the identity
# let positions and rotations part: one dead angle a joint.
DEAD_JOINTS = 4.0
# Positions beyond this count as there [m]: `judge_pose` takes none beyond 1e75.
FARTHEST = 1e74
NEITHER = sentence("The answer has neither rotations nor positions.")


@dataclass(frozen=True, eq=False)
class AnsweredPose:
    """An answer as the laws see it."""

    path: IndexArray  # joints from the root to the effector
    raw: FloatArray | None  # local rotations as they came
    local: FloatArray | None  # the same, normalised, with `with_effector_of`
    given: FloatArray | None  # positions as they came [m]
    positions: FloatArray  # where the joints are: by the rotations if there are any [m]
    judgement: PoseJudgement | None  # None if numbers are missing

    @property
    def finite(self) -> bool:
        """Whether the joints of the path are somewhere."""
        return bool(np.isfinite(self.positions[self.path]).all())

    @cached_property
    def drift(self) -> float:
        """How far rotations are off unit length at most."""
        if self.raw is None:
            return 0.0
        errors = np.abs(np.linalg.norm(self.raw, axis=-1) - 1.0)
        return float(np.nanmax(errors[self.path], initial=0.0))

    @property
    def comparable(self) -> Mapping[str, Any]:
        """What variants are compared with; the effector's own rotation moves nothing above it."""
        outputs: dict[str, Any] = {}
        if self.given is not None:
            outputs["positions"] = self.given
        if self.local is not None:
            outputs |= {"local_rotations": self.local, "placed": self.positions}
        return outputs

    @property
    def distance(self) -> float:
        """How far the effector is from its target [m]."""
        return np.inf if self.judgement is None else self.judgement.distance

    def distance_to(self, positions: FloatArray) -> float:
        """Return how far a coordinate of a joint of the path is from other positions [m]."""
        return float(np.abs(self.positions[self.path] - positions[self.path]).max())


def understood(
    values: Mapping[str, Any], inputs: Mapping[str, Any], facts: Mapping[str, Any]
) -> AnsweredPose:
    """Return an answer as the laws see it."""
    raw: FloatArray | None = values.get("local_rotations")
    given: FloatArray | None = values.get("positions")
    path = facts["path"]
    local = None if raw is None else _normalised(with_effector_of(np.array(raw), inputs))
    pose = None if local is None else _placeable(local, path, inputs["local_rotations"])
    x = given if given is not None and np.isfinite(given).all() else None
    judgement = None
    if pose is not None or x is not None:
        x = None if x is None else np.clip(x, -FARTHEST, FARTHEST)
        skeleton = Skeleton(inputs["parents"], inputs["offsets"])
        judgement = judge_pose(skeleton, pose, inputs["target"], inputs["effector"], positions=x)
    positions = np.full(np.shape(inputs["offsets"]), np.nan)
    if local is None and given is not None:
        positions = given
    elif pose is not None and judgement is not None:
        positions = judgement.positions
    return AnsweredPose(path, raw, local, given, positions, judgement)


def _normalised(local: FloatArray) -> FloatArray:
    with np.errstate(all="ignore"):  # no length, or infinite numbers, give NaN
        return local / np.linalg.norm(local, axis=-1, keepdims=True)


def _placeable(local: FloatArray, path: IndexArray, start: FloatArray) -> FloatArray | None:
    """Return rotations, those of the start where they do not move the path; None if one lacks."""
    usable = np.linalg.norm(local, axis=-1) > 0.5
    return np.where(usable[:, None], local, start) if usable[path[:-1]].all() else None


def all_of(posed: AnsweredPose, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings that hold for every pose, whatever its target."""
    if not posed.comparable:
        return [laws.missing(NEITHER)]
    findings = rotation_laws(posed, case, greeting)
    if posed.given is not None:
        findings += position_laws(posed, case, greeting)
    return findings


def rotation_laws(posed: AnsweredPose, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings of local rotations: numbers, norms, joints that have to stay."""
    if posed.raw is None or posed.local is None:
        return []
    bound = rounding.rotations(greeting.epsilon, len(posed.raw))
    lengths = np.linalg.norm(posed.raw, axis=-1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    findings = [] if usable.all() else [_unusable(usable, posed.local, case, bound)]
    if not np.isfinite(posed.local).all():
        return findings
    lengths = np.where(usable, lengths, 1.0)
    if usable.any():
        findings.append(laws.unit(lengths, bound))
    start = case.inputs["local_rotations"]
    theirs = np.where(usable[:, None], posed.raw / lengths[:, None], start)
    moved = laws.angles(theirs, start / np.linalg.norm(start, axis=-1, keepdims=True))
    moved[posed.path[:-1]] = 0.0
    return [*findings, _untouched(moved, bound, case.inputs["effector"])]


def _unusable(usable: Any, local: FloatArray, case: Case, bound: float) -> Finding:
    """Return the finding of rotations that are no numbers; the effector's own may not matter."""
    joint = int(np.argmin(usable))
    matters = joint != case.inputs["effector"] or not np.isfinite(local).all()
    message = sentence("The local rotation of joint {joint} is not a number or zero.", joint=joint)
    verdict = Verdict.BROKEN if matters else Verdict.RIGHT_BUT
    return Finding("numbers", verdict, np.inf, bound, "", message, joint)


def _untouched(moved: FloatArray, bound: float, effector: int) -> Finding:
    joint = int(np.argmax(moved))
    law, verdict = "joints off the path", Verdict.RIGHT_BUT if joint == effector else Verdict.WRONG
    message = sentence(
        "It rotates the effector itself by {error:.2g} rad, which brings the effector nowhere "
        "but moves what is below."
        if joint == effector
        else "It rotates joint {joint}, which is not on the path from the root to the effector."
    )
    return laws.bounded(law, moved[joint], bound, "rad", message, verdict=verdict, where=joint)


def position_laws(posed: AnsweredPose, case: Case, greeting: Greeting) -> list[Finding]:
    """Return the findings of positions: numbers, the root's place, lengths, branches, rotations."""
    x = posed.given
    assert x is not None
    bound = rounding.positions(greeting.epsilon, len(x), case.facts["size"], posed.drift)
    if not np.isfinite(x).all():
        return [laws.no_numbers("numbers", x.sum(axis=-1), bound)]
    assert posed.judgement is not None
    parents, offsets = case.inputs["parents"], case.inputs["offsets"]
    moved = float(np.linalg.norm(x[0] - offsets[0]))
    assert posed.judgement.length_errors is not None
    lengthened = sentence(
        "The link to joint {joint} has another length than its offset, by {error:.2g} m."
    )
    message = sentence("The root has moved by {error:.2g} m.")
    return [
        laws.bounded("root in place", moved, bound, "m", message, where=0),
        laws.of_joints("link lengths", posed.judgement.length_errors, bound, "m", lengthened),
        _branches(x, parents, offsets, 2.0 * bound),
        *_agreement(posed, case, 2.0 * bound, greeting),
    ]


def _branches(x: FloatArray, parents: IndexArray, offsets: FloatArray, bound: float) -> Finding:
    """Return whether the children of a joint keep their distances: they rotate as one body."""
    error, joint = 0.0, 0
    for j in range(2, len(parents)):
        for sibling in np.flatnonzero(parents[:j] == parents[j]):
            length = np.linalg.norm(offsets[j] - offsets[sibling])
            change = abs(float(np.linalg.norm(x[j] - x[sibling]) - length))
            error, joint = max((error, joint), (change, j), key=lambda pair: pair[0])
    message = sentence(
        "Joint {joint} does not keep its distance from another child of the same parent: it is "
        "{error:.2g} m off. A parent rotates all its children as one body."
    )
    return laws.bounded("branches", error, bound, "m", message, where=joint)


def _agreement(posed: AnsweredPose, case: Case, bound: float, greeting: Greeting) -> list[Finding]:
    """Return whether positions are where the rotations put the joints."""
    errors = None if posed.judgement is None else posed.judgement.position_errors
    carriers = case.inputs["parents"][1:]
    if errors is None or posed.local is None or not np.isfinite(posed.local[carriers]).all():
        return []
    dead = DEAD_JOINTS * rounding.DEAD_ANGLE[greeting.precision] * case.facts["reach"]
    message = sentence("Joint {joint} is {error:.2g} m from where the answer's rotations put it.")
    verdict = Verdict.RIGHT_BUT if errors.max() <= dead else Verdict.WRONG
    return [laws.of_joints("rotations agree with positions", errors, bound, "m", message, verdict)]
