"""What answers of kinematics show: each joint is judged given the rest of the answer.

A joint's pose is held against the answered pose of its parent, a rotation of CCD against the
answers for the joints below, a point of FABRIK against the point before. Otherwise an error at one
joint would spread to all joints below, and its place would not show.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import quaternion, rotation
from plumbob.reference.arguments import BoolArray, FloatArray, IndexArray

from ..case import Case
from ..contestant import Answer
from ..judgement import CaseJudgement, TaskReport, Verdict
from ..kinematics.pose_laws import read_pose
from ..kinematics.predictions import forward, solve
from ..kinematics.textbook import SOLVERS
from .equalities import Equalities
from .separation import TOLERANCE, ElementTable

# Rotations by less count as none [rad]: the sine of half the angle is then about rounding.
UNROTATED = 1e-7
# What holds of one sweep alone, and means nothing if a solver makes another number.
OF_ONE_SWEEP = ("turn", "point")
EQUALITIES_OF_ONE_SWEEP = ("half_turn", "double_turn", "wrong_axis")
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


class JointEvidence(NamedTuple):
    """Tables by quantity, and equalities."""

    tables: dict[str, ElementTable]
    equalities: Equalities


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


def case_features(case: Case) -> dict[str, bool]:
    """Return the features of a request of inverse kinematics as a whole."""
    inputs = case.inputs
    return {
        "one_sweep": inputs["max_iterations"] == 1,
        "two_sweeps": inputs["max_iterations"] <= 2,
        "zero_tolerance": inputs["tolerance"] == 0.0,
    }


def angles(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the angles between rotations [rad], NaN where a quaternion is none."""
    a, b = _unit(p), _unit(q)
    gaps = (((a - s * b) ** 2).sum(axis=-1) for s in (1.0, -1.0))  # of either sign of a quaternion
    first, second = map(np.sqrt, gaps)
    return 4.0 * np.arctan2(np.minimum(first, second), np.maximum(first, second))


def _unit(q: FloatArray) -> FloatArray:
    """Return unit quaternions, NaN in place of invalid ones."""
    squares = (q * q).sum(axis=-1, keepdims=True)
    return q / np.sqrt(np.where(squares > 1e-24, squares, np.nan))


# Forward kinematics


def forward_evidence(judgements: Sequence[CaseJudgement]) -> JointEvidence:
    """Return what answers of forward kinematics show.

    A joint without rotation, and a link without length, count for neither side: they are right
    whatever a solver does.
    """
    sound = sound_cases(judgements)
    tables = {name: ElementTable(name, sound) for name in ("rotation", "position")}
    equalities = Equalities(sound)
    for judgement in judgements:
        assert isinstance(judgement.answer, Answer)
        pose = ForwardPose(judgement.case.inputs, judgement.answer.values, judgement.expected)
        _add_forward(judgement.case.name, pose, tables, equalities)
    return JointEvidence(tables, equalities)


class ForwardPose:
    """An answered and a right pose of a skeleton, seen from the parent of each joint."""

    def __init__(
        self, inputs: Mapping[str, Any], outputs: Mapping[str, Any], right: Mapping[str, Any]
    ) -> None:
        self.inputs, self.right = inputs, right
        self.parents = np.asarray(inputs["parents"])
        self.offsets, self.local = inputs["offsets"], inputs["local_rotations"]
        self.positions, self.raw = outputs.get("positions"), outputs.get("rotations")
        self.size = float(np.linalg.norm(self.offsets, axis=1).sum()) + 1e-300
        answered = _unit(right["rotations"] if self.raw is None else self.raw)
        self.rotations = np.where(np.isfinite(answered), answered, right["rotations"])
        self.is_link = self.parents >= 0

    def of_parent(self, rotations: FloatArray) -> FloatArray:
        """Return the global rotation of each joint's parent, the identity for the root."""
        return np.where(self.is_link[:, None], rotations[self.parents], IDENTITY)


def _add_forward(
    name: str, pose: ForwardPose, tables: Mapping[str, ElementTable], equalities: Equalities
) -> None:
    features = joint_features(pose.inputs)
    parent = pose.of_parent(pose.rotations)
    if pose.raw is not None:
        due = rotation.multiply(parent, pose.local)
        is_rotated = np.abs(pose.local[:, 1:]).max(axis=1) > UNROTATED
        tables["rotation"].add(name, angles(pose.raw, due), features, is_counted=is_rotated)
        _add_products(name, pose, parent, equalities)
    if pose.positions is not None:
        x = pose.positions
        origin = np.where(pose.is_link[:, None], x[pose.parents], 0.0)
        due = origin + rotation.rotate(parent, pose.offsets)
        gaps, is_long = np.abs(x - due).max(axis=1) / pose.size, np.any(pose.offsets, axis=1)
        tables["position"].add(name, gaps, features, is_counted=is_long)
        _add_frames(name, pose, x - origin, equalities)


def _add_products(name: str, pose: ForwardPose, parent: FloatArray, equalities: Equalities) -> None:
    """Add other rules by which a joint's rotation may follow from the parent's and its own."""
    assert pose.raw is not None
    links, own, raw = pose.is_link, pose.local, pose.raw
    rules = {
        "own_first": rotation.multiply(own, parent),
        "parent_alone": parent,
        "own_alone": own,
    }
    values = np.stack([np.broadcast_to(value, own.shape) for value in rules.values()])[:, links]
    answered, right = (angles(q[links], values) for q in (raw, pose.right["rotations"]))
    for key, gaps, right_gaps in zip(rules, answered, right, strict=True):
        equalities.add(key, name, gaps, right_gaps)


def _add_frames(name: str, pose: ForwardPose, links: FloatArray, equalities: Equalities) -> None:
    """Add other frames in which a joint's offset may stand; rotations are the right ones."""
    R, local, parents = pose.right["rotations"], pose.local, pose.parents
    right = rotation.rotate(pose.of_parent(R), pose.offsets)
    frames = {
        "frame_none": np.broadcast_to(IDENTITY, R.shape),
        "frame_own": R,
        "frame_parent_local": local[parents],
        "frame_inverse": rotation.conjugate(R[parents]),
    }
    values = rotation.rotate(np.stack(list(frames.values())), pose.offsets[None])
    for key, value in zip(frames, values, strict=True):
        gaps = (np.abs(v - value).max(axis=1)[pose.is_link] / pose.size for v in (links, right))
        equalities.add(key, name, *gaps)


# Inverse kinematics


def inverse_evidence(report: TaskReport, judgements: Sequence[CaseJudgement]) -> JointEvidence:
    """Return what poses of inverse kinematics show; right sweeps are those of the method."""
    method = _method(report)
    names = ("agreement", "unmoved", "length", *OF_ONE_SWEEP)
    sound, of_cases = sound_cases(judgements), ("root_position", "target", "pose")
    tables = {name: ElementTable(name, sound) for name in names}
    tables |= {name: ElementTable(name, sound, is_of_cases=True) for name in of_cases}
    evidence = JointEvidence(tables, Equalities(sound))
    for judgement in judgements:
        pose = SolvedPose(judgement, method)
        if pose.is_valid:
            _add_pose(pose, evidence)
    return evidence


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
    """An answered pose, the start, and the right pose where a method has one."""

    def __init__(self, judgement: CaseJudgement, method: str) -> None:
        assert isinstance(judgement.answer, Answer)
        self.judgement, self.method = judgement, method
        self.case, self.inputs = judgement.case, judgement.case.inputs
        self.name, self.parents = self.case.name, np.asarray(self.inputs["parents"])
        self.offsets, self.start = self.inputs["offsets"], self.inputs["local_rotations"]
        self.pose = read_pose(judgement.answer.values, self.inputs, self.case.facts)
        self.path: IndexArray = self.pose.path
        self.size = float(np.linalg.norm(self.offsets, axis=1).sum()) + 1e-300
        self.local = judgement.answer.values.get("local_rotations")
        self.effector = int(self.inputs["effector"])
        self.right_local: FloatArray | None = None
        self.right_positions: FloatArray | None = None
        if method and "sweeps" in self.case.facts:
            self.right_local, self.right_positions, _ = solve(method, self.inputs)

    @property
    def is_valid(self) -> bool:
        """Whether the joints of the path have positions."""
        return self.pose.finite

    @property
    def is_one_sweep(self) -> bool:
        """Whether a single sweep is asked, which no tolerance ends."""
        return self.inputs["max_iterations"] == 1 and self.inputs["tolerance"] == 0.0

    @property
    def links(self) -> FloatArray | None:
        """The answered lengths of all links, None without positions."""
        x = self.pose.answered_positions
        return None if x is None else np.linalg.norm(x[1:] - x[self.parents[1:]], axis=1)


def _add_pose(pose: SolvedPose, evidence: JointEvidence) -> None:
    tables, features = evidence.tables, joint_features(pose.inputs)
    whole, x = case_features(pose.case), pose.pose.answered_positions
    y = pose.pose.positions
    for finding in pose.judgement.findings:
        if finding.law == "target reached" and finding.verdict is not Verdict.UNDECIDED:
            tables["target"].add(pose.name, float(finding.verdict >= Verdict.WRONG), whole)
    root = y if x is None else x
    gap = np.abs(root[0] - pose.offsets[0]).max() / pose.size
    tables["root_position"].add(pose.name, gap, whole)
    if pose.right_positions is not None:
        gap = np.abs(y - pose.right_positions)[pose.path].max() / pose.size
        allowed = TOLERANCE * pose.inputs["max_iterations"]  # rounding adds up over sweeps
        tables["pose"].add(pose.name, gap, whole, allowed)
    if x is not None:
        links = {key: column[1:] for key, column in features.items()}
        due = np.linalg.norm(pose.offsets[1:], axis=1)
        tables["length"].add(pose.name, np.abs(pose.links - due) / pose.size, links)
        _add_lengths(pose, evidence.equalities)
    if pose.local is not None:
        _add_rotations(pose, evidence, features)
    if pose.is_one_sweep and pose.method == "ccd" and pose.local is not None:
        _add_turns(pose, evidence, features)
    if pose.is_one_sweep and pose.method == "fabrik":
        _add_points(pose, evidence, features)


def _add_lengths(pose: SolvedPose, equalities: Equalities) -> None:
    due = np.linalg.norm(pose.offsets, axis=1)[pose.path[1:]]
    x = pose.pose.answered_positions
    assert x is not None
    links = np.linalg.norm(np.diff(x[pose.path], axis=0), axis=1)
    gaps = (np.abs(lengths[1:] - due[:-1]) / pose.size for lengths in (links, due))
    equalities.add("length_before", pose.name, *gaps)


def _add_rotations(
    pose: SolvedPose, evidence: JointEvidence, features: Mapping[str, BoolArray]
) -> None:
    """Add what answered local rotations show, of the path and elsewhere."""
    local, x, parents = pose.local, pose.pose.answered_positions, pose.parents
    assert local is not None
    if x is not None and pose.pose.local is not None:
        y = pose.pose.positions
        links = {key: column[1:] for key, column in features.items()}
        gaps = (x[1:] - x[parents[1:]]) - (y[1:] - y[parents[1:]])
        evidence.tables["agreement"].add(pose.name, np.abs(gaps).max(axis=1) / pose.size, links)
    is_moved = np.isin(np.arange(len(parents)), pose.path)
    gaps = angles(local, pose.start)
    evidence.tables["unmoved"].add(pose.name, gaps, features, is_counted=~is_moved)
    if pose.right_local is not None:
        _add_roles(pose, local, gaps, evidence.equalities)


def _add_roles(
    pose: SolvedPose, local: FloatArray, changes: FloatArray, equalities: Equalities
) -> None:
    """Add equalities with the request of joints that have a role, held against right sweeps."""
    right = pose.right_local
    assert right is not None
    right_changes = angles(right, pose.start)
    path, effector = pose.path, pose.effector

    def add(key: str, joints: Any, gaps: FloatArray, right_gaps: FloatArray) -> None:
        equalities.add(key, pose.name, gaps[joints], right_gaps[joints])

    add("root_kept", path[0], changes, right_changes)
    add("effector_parent_kept", int(pose.parents[effector]), changes, right_changes)
    add("inner_kept", path[1:-1], changes, right_changes)
    start, answered, due = (_global_rotations(pose, q) for q in (pose.start, local, right))
    add("effector_global_kept", effector, angles(answered, start), angles(due, start))
    add("global_answered", path, angles(local, due), angles(right, due))


def _global_rotations(pose: SolvedPose, local: FloatArray) -> FloatArray:
    unit = np.where(np.isfinite(local), _unit(local), IDENTITY)
    return forward({**pose.inputs, "local_rotations": unit})[1]


def _add_turns(
    pose: SolvedPose, evidence: JointEvidence, features: Mapping[str, BoolArray]
) -> None:
    """Add the rotation of each joint in a sweep of CCD, given the answers for the joints below."""
    local, joints = pose.pose.local, pose.path[-2::-1]
    if local is None or not len(joints) or not np.isfinite(local[pose.path]).all():
        return
    x, G = forward(pose.inputs)
    ends = np.array(list(_effector_in_frames(pose, local)))
    before = np.where(pose.parents[joints, None] >= 0, G[pose.parents[joints]], IDENTITY)
    to_target = pose.inputs["target"] - x[joints]
    to_effector = rotation.rotate(G[joints], ends)
    turns = rotation.between(to_effector, to_target)
    due = rotation.multiply(rotation.conjugate(before), rotation.multiply(turns, G[joints]))
    after = rotation.multiply(before, local[joints])
    need, turned = angles(turns, IDENTITY), angles(after, G[joints])
    places: dict[str, Any] = {key: column[joints] for key, column in features.items()}
    is_plain = np.abs(before[:, 1:]).max(axis=1) < UNROTATED
    places |= {"unrotated_parent": is_plain, "obtuse": need > np.pi / 2.0}
    evidence.tables["turn"].add(pose.name, angles(local[joints], due), places)
    miss = angles(rotation.between(rotation.rotate(after, ends), to_target), IDENTITY)
    for key, gaps, right_gaps in (
        ("half_turn", np.abs(turned - need / 2.0), need / 2.0),
        ("double_turn", np.abs(turned - np.pi + np.abs(np.pi - 2.0 * need)), need),
        ("wrong_axis", np.abs(turned - need), miss),
    ):
        evidence.equalities.add(key, pose.name, gaps, right_gaps)


def _effector_in_frames(pose: SolvedPose, local: FloatArray) -> Iterator[tuple[float, ...]]:
    """Yield the effector's position in the frame of each joint of the path, the lowest first."""
    end: tuple[float, ...] = (0.0, 0.0, 0.0)
    for joint in pose.path[:0:-1]:
        turned = quaternion.rotate(tuple(local[joint].tolist()), end)
        end = quaternion.add(tuple(pose.offsets[joint].tolist()), turned)
        yield end


def _add_points(
    pose: SolvedPose, evidence: JointEvidence, features: Mapping[str, BoolArray]
) -> None:
    """Add the points of FABRIK's forward pass, each given the answered point before."""
    y = pose.pose.positions[pose.path]
    z = np.array(forward(pose.inputs)[0][pose.path])
    lengths = np.linalg.norm(pose.offsets, axis=1)[pose.path[1:]]
    z[-1] = pose.inputs["target"]
    for k in range(len(z) - 2, -1, -1):
        z[k] = z[k + 1] + lengths[k] * _direction(z[k] - z[k + 1])
    due = [b + r * _direction(end - b) for b, r, end in zip(y, lengths, z[1:], strict=False)]
    if due:
        gaps = np.abs(y[1:] - np.array(due)).max(axis=1) / pose.size
        places = {key: column[pose.path[1:]] for key, column in features.items()}
        evidence.tables["point"].add(pose.name, gaps, places)


def _direction(v: FloatArray) -> FloatArray:
    return v / max(float(np.linalg.norm(v)), 1e-300)
