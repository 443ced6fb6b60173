"""What answers of kinematics show: each joint is judged given the rest of the answer.

A joint's pose is compared with the answered pose of its parent, and a point of FABRIK with the
point before. A rotation of CCD is compared with the answers for the joints below. Otherwise an
error at one joint would spread to all joints below, and hide its place.
"""

from collections.abc import Mapping, Sequence, Set
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray, IndexArray
from plumbob.text.sentence import sentence

from ..exchange import Answer
from ..judgement import CaseJudgement, TaskReport, Verdict
from ..kinematics.pose_laws import read_pose
from ..kinematics.predictions import forward, solve
from ..kinematics.textbook import SOLVERS
from .equalities import Equalities
from .separation import BETWEEN, MIN_CASES, TOLERANCE, ElementTable, Findings, Statement

# Rotations by less count as none [rad]: the sine of half the angle is then about rounding.
UNROTATED = 1e-7
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
# By what the angles of rotations in a sweep of CCD may be multiplied.
FACTORS = {
    "half_turn": 0.5, "double_turn": 2.0, "turn_in_degrees": 180.0 / np.pi,
    "turn_in_radians": np.pi / 180.0,
}  # fmt: skip


def sound_cases(judgements: Sequence[CaseJudgement]) -> frozenset[str]:
    """Return the names of the cases whose verdict is right."""
    return frozenset(
        judgement.case.name
        for judgement in judgements
        if judgement.findings and judgement.verdict <= Verdict.RIGHT_EXCEPT
    )


def joint_features(inputs: Mapping[str, Any]) -> dict[str, BoolArray]:
    """Return the features of all joints of a request."""
    parents = np.asarray(inputs["parents"])
    joints, indices = len(parents), np.arange(len(parents))
    children = np.bincount(parents[1:], minlength=joints)
    features = {
        "root": indices == 0,
        "leaf": children == 0,
        "child_of_root": parents == 0,
        "branching": children > 1,
        "last_joint": indices == joints - 1,
        "after_branch": (parents != indices - 1) & (indices > 0),
    }
    if "effector" in inputs:
        effector = int(inputs["effector"])
        features |= {"effector": indices == effector, "first_rotated": indices == parents[effector]}
    return features


def angles(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the angles between rotations [rad], NaN where a quaternion is none."""
    a, b = _unit(p), _unit(q)
    gaps = (((a - s * b) ** 2).sum(axis=-1) for s in (1.0, -1.0))  # of either sign of a quaternion
    first, second = map(np.sqrt, gaps)
    return 4.0 * np.arctan2(np.minimum(first, second), np.maximum(first, second))


def _unit(q: FloatArray) -> FloatArray:
    """Return unit quaternions, NaN in place of invalid quaternions."""
    squares = (q * q).sum(axis=-1, keepdims=True)
    return q / np.sqrt(np.where(squares > 1e-24, squares, np.nan))


def _of_parents(values: FloatArray, parents: IndexArray, root: Any) -> FloatArray:
    """Return the values of each joint's parent, and what stands in their place for the root."""
    return np.where(parents[:, None] >= 0, values[parents], root)


def _at(features: Mapping[str, BoolArray], joints: Any) -> dict[str, BoolArray]:
    return {name: column[joints] for name, column in features.items()}


def _size(offsets: FloatArray) -> float:
    """Return the length of all links, by which errors are divided [m]."""
    return float(np.linalg.norm(offsets, axis=1).sum()) + 1e-300


# Forward kinematics


def forward_evidence(judgements: Sequence[CaseJudgement]) -> Findings:
    """Return what answers of forward kinematics show.

    A joint without rotation, and a link without length, count for neither side: both are right for
    any solver.
    """
    sound = sound_cases(judgements)
    tables = {name: ElementTable(name, sound) for name in ("rotation", "position")}
    equalities, poses = Equalities(sound), list(map(ForwardPose, judgements))
    for pose in poses:
        _add_forward(pose, tables, equalities)
    return Findings(tables, [*equalities.strongest(), *_other_parents(poses)], [])


class ForwardPose:
    """An answered and a right pose of a skeleton, seen from the parent of each joint."""

    def __init__(self, judgement: CaseJudgement) -> None:
        assert isinstance(judgement.answer, Answer)
        self.name, outputs = judgement.case.name, judgement.answer.values
        self.inputs, self.right = judgement.case.inputs, judgement.expected["rotations"]
        self.parents = np.asarray(self.inputs["parents"])
        self.offsets, self.local = self.inputs["offsets"], self.inputs["local_rotations"]
        self.positions: Any = outputs.get("positions")
        self.raw: Any = outputs.get("rotations")
        unit = _unit(self.right if self.raw is None else self.raw)
        self.rotations = np.where(np.isfinite(unit), unit, self.right)
        self.above = _of_parents(self.rotations, self.parents, IDENTITY)

    @property
    def links(self) -> FloatArray:
        """The answered vectors from each joint's parent to the joint [m]."""
        return self.positions - _of_parents(self.positions, self.parents, 0.0)

    @property
    def gaps(self) -> FloatArray:
        """How far joints are from where the answer for their parent puts them, over the size."""
        due = rotation.rotate(self.above, self.offsets)
        return np.abs(self.links - due).max(axis=1) / _size(self.offsets)

    @property
    def turns(self) -> FloatArray:
        """By what angle joints differ from what follows from the answer for their parent [rad]."""
        return angles(self.raw, rotation.multiply(self.above, self.local))

    @property
    def wrong(self) -> BoolArray:
        """Joints without the pose by the answer for their parent."""
        if self.positions is None or self.raw is None:
            return np.zeros(len(self.parents), dtype=bool)
        return ~(np.maximum(self.gaps, self.turns) <= BETWEEN * TOLERANCE)

    def carriers(self, joint: int) -> IndexArray:
        """Return the joints whose answered poses give the pose of a joint."""
        R = self.rotations
        gaps = self.positions + rotation.rotate(R, self.offsets[joint]) - self.positions[joint]
        turns = angles(self.raw[joint], rotation.multiply(R, self.local[joint]))
        gap = np.maximum(np.abs(gaps).max(axis=1) / _size(self.offsets), turns)
        return np.flatnonzero((gap <= TOLERANCE) & (np.arange(len(R)) != joint))


def _add_forward(
    pose: ForwardPose, tables: Mapping[str, ElementTable], equalities: Equalities
) -> None:
    features, local, offsets = joint_features(pose.inputs), pose.local, pose.offsets
    if pose.raw is not None:
        is_rotated = np.abs(local[:, 1:]).max(axis=1) > UNROTATED
        tables["rotation"].add(pose.name, pose.turns, features, is_counted=is_rotated)
        _add_products(pose, pose.raw, equalities)
    if pose.positions is not None:
        is_long = np.any(offsets, axis=1)
        tables["position"].add(pose.name, pose.gaps, features, is_counted=is_long)
        _add_frames(pose, pose.links, equalities)


def _add_products(pose: ForwardPose, raw: FloatArray, equalities: Equalities) -> None:
    """Add other rules by which a joint's rotation may follow from the parent's and its own."""
    rules = {
        "own_first": rotation.multiply(pose.local, pose.above),
        "parent_alone": pose.above,
        "own_alone": pose.local,
        "parent_local": rotation.multiply(pose.local[pose.parents], pose.local),
        "parent_local_last": rotation.multiply(pose.local, pose.local[pose.parents]),
    }
    below = pose.parents >= 0
    for key, value in rules.items():
        gaps = (angles(q[below], value[below]) for q in (raw, pose.right))
        equalities.add(key, pose.name, *gaps)


def _add_frames(pose: ForwardPose, links: FloatArray, equalities: Equalities) -> None:
    """Add other frames in which a joint's offset may stand; rotations are right."""
    R, parents, offsets = pose.right, pose.parents, pose.offsets
    right = rotation.rotate(_of_parents(R, parents, IDENTITY), offsets)
    frames = {
        "frame_none": IDENTITY,
        "frame_own": R,
        "frame_parent_local": pose.local[parents],
        "frame_inverse": rotation.conjugate(R[parents]),
    }
    for key, frame in frames.items():
        value = rotation.rotate(np.broadcast_to(frame, R.shape), offsets)
        gaps = (
            np.abs(v - value).max(axis=1)[parents >= 0] / _size(offsets) for v in (links, right)
        )
        equalities.add(key, pose.name, *gaps)


def _other_parents(poses: Sequence[ForwardPose]) -> list[Statement]:
    """Return the sentence on wrong joints at another joint than their parent, or []."""
    hanging = [
        (pose, j, pose.carriers(j)) for pose in poses for j in map(int, np.flatnonzero(pose.wrong))
    ]
    cases = {pose.name for pose, _, _ in hanging}
    if len(cases) < MIN_CASES or not all(len(joints) for _, _, joints in hanging):
        return []
    pose, joint, joints = hanging[0]
    words = sentence(
        "Every wrong joint hangs from another joint than its parent ({count}): in the case "
        "'{case}' joint {joint} hangs from joint {other} and not from joint {parent}.",
        count=len(hanging), case=pose.name, joint=joint, other=int(joints[0]),
        parent=int(pose.parents[joint]),
    )  # fmt: skip
    return [Statement(-float(len(cases)), words, is_exact=True)]


# Inverse kinematics


def inverse_evidence(
    report: TaskReport, judgements: Sequence[CaseJudgement], unread: Set[str] = frozenset()
) -> Findings:
    """Return what poses of inverse kinematics show; right sweeps are the method's.

    If `max_iterations` is unread, no answer belongs to a single sweep.
    """
    method, reads_sweeps = _method(report), "max_iterations" not in unread
    sound = sound_cases(judgements)
    of_cases = "root_position", "pose", "end", "approach"
    names = ("agreement", "unmoved", "length", "turn", "point", *of_cases)
    tables = {name: ElementTable(name, sound, is_of_cases=name in of_cases) for name in names}
    equalities = Equalities(sound)
    for judgement in judgements:
        pose = SolvedPose(judgement, method, tables, equalities)
        if pose.answer.finite:
            pose.add()
            pose.add_end()
        if pose.answer.finite and reads_sweeps:
            pose.add_sweeps()
    if any(tables[name].is_wrong_everywhere for name in ("turn", "point", "root_position")):
        del tables["pose"]  # which is then wrong as well
    at_origin = equalities.statement("root_at_origin")
    if at_origin is None:
        return Findings(tables, equalities.strongest(), [])
    del tables["root_position"]  # all else is judged with the root where it is
    return Findings(tables, [at_origin], [], is_more_wrong=True)


def _method(report: TaskReport) -> str:
    """Return the declared method, or the method whose sweeps the judge expects, or ""."""
    if report.method.lower() in SOLVERS:
        return report.method.lower()
    expected = next((j for j in report.judgements if "local_rotations" in j.expected), None)
    if expected is None:
        return ""
    x = expected.expected["positions"]
    gaps = {m: np.abs(solve(m, expected.case.inputs)[1] - x).max() for m in SOLVERS}
    return min(gaps, key=lambda name: gaps[name])


class SolvedPose:
    """An answered pose, the start, and the right pose, if unique.

    Each method adds what the answer shows to tables and equalities.
    """

    def __init__(
        self,
        judgement: CaseJudgement,
        method: str,
        tables: Mapping[str, ElementTable],
        equalities: Equalities,
    ) -> None:
        assert isinstance(judgement.answer, Answer)
        case = judgement.case
        self.name, self.inputs, self.method = case.name, case.inputs, method
        self.facts = case.facts
        self.tables, self.equalities = tables, equalities
        self.parents, self.offsets = np.asarray(case.inputs["parents"]), case.inputs["offsets"]
        self.start, self.size = case.inputs["local_rotations"], _size(self.offsets)
        self.features = joint_features(case.inputs)
        self.answer = read_pose(judgement.answer.values, case.inputs, case.facts)
        self.path = self.answer.path
        self.local = judgement.answer.values.get("local_rotations")
        self.right = solve(method, case.inputs) if method and "sweeps" in case.facts else None

    def add(self) -> None:
        """Add what the pose shows whatever the number of sweeps."""
        x = self.answer.answered_positions
        root = (self.answer.positions if x is None else x)[0]
        gap = np.abs(root - self.offsets[0]).max() / self.size
        self.tables["root_position"].add(self.name, gap, self._whole())
        gaps = (np.abs(point).max() / self.size for point in (root, self.offsets[0]))
        self.equalities.add("root_at_origin", self.name, *gaps)
        if x is not None:
            self._add_links(x)
        if self.local is not None:
            self._add_rotations(self.local)

    def add_end(self) -> None:
        """Add the distance from the target: after whole solves, and after sweeps of a method."""
        facts, allowed = self.facts, self.inputs["tolerance"] / self.size + TOLERANCE
        if "sweeps" not in facts:
            excess = (self.answer.distance - facts["least"]) / self.size
            links = np.linalg.norm(self.offsets[self.path[1:]], axis=1)
            distance = np.linalg.norm(self.inputs["target"] - self.offsets[0])
            is_beyond = bool(distance > (1.0 + TOLERANCE) * links.sum())
            features = {"beyond_reach": is_beyond, "one_link": len(self.path) == 2}
            self.tables["end"].add(self.name, excess, features, allowed)
        elif self.method:
            growth = (self.answer.distance - facts["before"]) / self.size
            self.tables["approach"].add(self.name, growth, self._whole())

    def add_sweeps(self) -> None:
        """Add the pose after all sweeps, and what a single sweep shows, which no tolerance ends."""
        if self.right is not None:
            gap = np.abs(self.answer.positions - self.right[1])[self.path].max() / self.size
            allowed = TOLERANCE * self.inputs["max_iterations"]  # rounding adds up over sweeps
            self.tables["pose"].add(self.name, gap, self._whole(), allowed)
        if self.inputs["max_iterations"] == 1 and self.inputs["tolerance"] == 0.0:
            if self.method == "ccd" and self.answer.local is not None:
                self._add_turns(self.answer.local)
            if self.method == "fabrik":
                self._add_points()

    def _whole(self) -> dict[str, bool]:
        """Return the features of the request as a whole."""
        sweeps = self.inputs["max_iterations"]
        return {
            "one_sweep": sweeps == 1,
            "two_sweeps": sweeps <= 2,
            "zero_tolerance": self.inputs["tolerance"] == 0.0,
        }

    def _add_links(self, x: FloatArray) -> None:
        """Add the lengths of answered links, and whether positions agree with rotations."""
        features, above = _at(self.features, slice(1, None)), self.parents[1:]
        y, links = self.answer.positions, x[1:] - x[above]
        lengths, due = (np.linalg.norm(v, axis=1) for v in (links, self.offsets[1:]))
        self.tables["length"].add(self.name, np.abs(lengths - due) / self.size, features)
        if self.answer.local is not None:
            gaps = np.abs(links - (y[1:] - y[above])).max(axis=1) / self.size
            self.tables["agreement"].add(self.name, gaps, features)

    def _add_rotations(self, local: FloatArray) -> None:
        """Add equalities with the request of joints of a role, and of joints off the path."""
        changes, path = angles(local, self.start), self.path
        is_off = ~np.isin(np.arange(len(self.parents)), path)
        self.tables["unmoved"].add(self.name, changes, self.features, is_counted=is_off)
        if self.right is None:
            return
        right = self.right[0]
        effector = int(self.inputs["effector"])
        start, globals_, due = map(self._global, (self.start, local, right))
        of_request = changes, angles(right, self.start)
        of_global = angles(globals_, start), angles(due, start)
        for key, joints, (gaps, right_gaps) in (
            ("root_kept", path[0], of_request),
            ("effector_parent_kept", self.parents[effector], of_request),
            ("inner_kept", path[1:-1], of_request),
            ("effector_global_kept", effector, of_global),
            ("global_answered", path, (angles(local, due), angles(right, due))),
        ):
            self.equalities.add(key, self.name, gaps[joints], right_gaps[joints])

    def _global(self, local: FloatArray) -> FloatArray:
        unit = np.where(np.isfinite(local), _unit(local), IDENTITY)
        return forward({**self.inputs, "local_rotations": unit})[1]

    def _add_turns(self, local: FloatArray) -> None:
        """Add the rotation of each joint in a sweep of CCD, given the answers for joints below."""
        joints = self.path[-2::-1]
        if not len(joints) or not np.isfinite(local[self.path]).all():
            return
        x, G = forward(self.inputs)
        ends, above = self._ends(local), _of_parents(G, self.parents, IDENTITY)[joints]
        to_target = self.inputs["target"] - x[joints]
        turns = rotation.between(rotation.rotate(G[joints], ends), to_target)
        due = rotation.multiply(rotation.conjugate(above), rotation.multiply(turns, G[joints]))
        after = rotation.multiply(above, local[joints])
        need, turned = angles(turns, IDENTITY), angles(after, G[joints])
        places = _at(self.features, joints) | {
            "unrotated_parent": np.abs(above[:, 1:]).max(axis=1) < UNROTATED,
            "obtuse": need > np.pi / 2.0,
        }
        self.tables["turn"].add(self.name, angles(local[joints], due), places)
        miss = angles(rotation.between(rotation.rotate(after, ends), to_target), IDENTITY)
        for key, factor in FACTORS.items():
            due_angles = np.abs(np.remainder(factor * need + np.pi, 2.0 * np.pi) - np.pi)
            gaps = np.abs(turned - due_angles) / max(factor, 1.0)  # which enlarges rounding
            self.equalities.add(key, self.name, gaps, np.abs(due_angles - need))
        self.equalities.add("wrong_axis", self.name, np.abs(turned - need), miss)

    def _ends(self, local: FloatArray) -> FloatArray:
        """Return the effector in the frame of each joint of the path, the lowest joint first."""
        end, ends = np.zeros(3), []
        for joint in self.path[:0:-1]:
            end = self.offsets[joint] + rotation.rotate(local[joint], end)
            ends.append(end)
        return np.array(ends)

    def _add_points(self) -> None:
        """Add the points of FABRIK's forward pass, each given the answered point before."""
        y, path = self.answer.positions[self.path], self.path
        z = np.array(forward(self.inputs)[0][path])
        lengths = np.linalg.norm(self.offsets, axis=1)[path[1:]]
        z[-1] = self.inputs["target"]
        for k in range(len(z) - 2, -1, -1):
            z[k] = z[k + 1] + lengths[k] * _direction(z[k] - z[k + 1])
        due = [b + r * _direction(end - b) for b, r, end in zip(y, lengths, z[1:], strict=False)]
        if due:
            gaps = np.abs(y[1:] - np.array(due)).max(axis=1) / self.size
            self.tables["point"].add(self.name, gaps, _at(self.features, path[1:]))


def _direction(v: FloatArray) -> FloatArray:
    return v / max(float(np.linalg.norm(v)), 1e-300)
