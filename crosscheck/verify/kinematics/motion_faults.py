"""Faults of robots that follow targets: the frames that they explain."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from plumbob.reference import Target, rotation, solve_ik
from plumbob.reference.arguments import BoolArray, FloatArray

from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from ..sentence import Sentence, with_code
from .faults import TABLE
from .robot_inverse_kinematics import FAULTS as MISREADINGS
from .robot_inverse_kinematics import LENIENT, Misreading
from .robot_models import mechanism, tool_pose
from .trajectories import Trajectory, twists_between

# Steps agree if they differ by less than this share, with one of these squared dampings [m^2].
SAME_STEP, DAMPINGS = 0.05, (1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 1.0)
# Singular values below this share of the largest are small.
SINGULAR = 0.05
# Fewer joints off their limits fit any step.
MIN_FREE = 5
# Frames that a fault has to explain before it is named, and the least share of those it concerns.
MIN_FRAMES, MIN_SHARE = 3, 0.5
# Joints that hold the same limit so closely are at it [rad].
AT_LIMIT = 1e-6
# A rotation by about 2 pi: by how much it may differ [rad].
WHOLE_TURN = 0.7


class Evidence(NamedTuple):
    """Frames that a fault concerns, and those of them that it explains, (frame) each."""

    concerned: BoolArray
    explained: BoolArray


# Returns the frames, given a motion and the laws that it breaks.
Signature = Callable[[Trajectory, set[str]], Evidence]


def diagnosis_of(
    judgements: Sequence[CaseJudgement], motions: Mapping[str, Trajectory]
) -> Diagnosis:
    """Return the faults that explain most of the frames that they concern, if a law is broken."""
    wrong = [
        (motions[judgement.case.name], _broken(judgement))
        for judgement in judgements
        if judgement.verdict >= Verdict.WRONG and judgement.case.name in motions
    ]
    if not wrong:
        return Diagnosis()
    misread = {key: partial(_misread, fault) for key, fault in MISREADINGS.items()}
    poses: Mapping[str, Signature] = {**EXACT, **misread}
    for signatures, by_family in ((poses, False), (STEPS, True), (VAGUE, False)):
        shares = {key: _share(rule, wrong, by_family) for key, rule in signatures.items()}
        key = max(shares, key=shares.__getitem__)
        if shares[key] >= MIN_SHARE:
            explanation = Explanation((key,), sentence_of(key), shares[key], 0.0)
            return Diagnosis((explanation,), variant_count=COUNT)
    return Diagnosis(variant_count=COUNT)


def sentence_of(key: str) -> Sentence:
    """Return the mistake, and its correction."""
    if key in MISREADINGS:
        return MISREADINGS[key].sentence
    entry = TABLE["robot_track"][key]
    return with_code(entry["code"], Sentence(entry["sentence"], {}))


def _broken(judgement: CaseJudgement) -> set[str]:
    return {found.law for found in judgement.findings if found.verdict >= Verdict.WRONG}


def _share(
    signature: Signature, wrong: Sequence[tuple[Trajectory, set[str]]], by_family: bool
) -> float:
    """Return the share of the concerned frames that a fault explains, in all cases or the best."""
    families: dict[str, list[Evidence]] = {}
    for motion, laws in wrong:
        family = motion.case.family if by_family else ""
        families.setdefault(family, []).append(signature(motion, laws))
    shares = [0.0]
    for evidence in families.values():
        concerned, explained = (np.concatenate(part) for part in zip(*evidence, strict=True))
        if concerned.sum() >= MIN_FRAMES:
            shares.append(float((explained & concerned).sum() / concerned.sum()))
    return max(shares)


# ---- signatures of faults


def _misread(fault: Misreading, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames whose coordinates, read otherwise, bring the tool to its target."""
    position, quaternion = motion.targets()
    request = {**motion.inputs, "target_position": position, "target_rotation": quaternion}
    inputs = fault.read(request)
    tool = tool_pose(inputs, fault.coordinates(inputs, motion.q))
    target = inputs["target_rotation"] if inputs["target_rotation"] is not None else tool.rotations
    target = tool._replace(positions=position, rotations=target)
    is_missed = motion.errors(motion.twists(motion.q)) > LENIENT
    is_missed &= motion.case.facts["reachable"] & (motion.inputs["max_iterations"] > 1)
    return Evidence(is_missed, motion.errors(twists_between(tool, target)) <= LENIENT)


def _step_gap(motion: Trajectory, J: FloatArray, q: FloatArray, twists: FloatArray) -> FloatArray:
    """Return how far frames are from a damped step from q along twists, of any length, (frame).

    Relative to the step; joints that end at a limit are left out.
    """
    changes, gap = motion.q - q, np.full(len(q), np.inf)
    is_free = ~at_limits(motion)
    for damping in DAMPINGS:
        inverse = np.linalg.inv(J @ np.swapaxes(J, 1, 2) + damping * np.eye(6))
        steps = np.einsum("fij,fik,fk->fj", J, inverse, twists) * is_free
        factors = (steps * changes).sum(-1) / np.maximum((steps * steps).sum(-1), 1e-300)
        gaps = np.linalg.norm((changes - factors[:, None] * steps) * is_free, axis=-1)
        gap = np.minimum(gap, np.where(factors > 0.0, gaps, np.inf))
    gap[is_free.sum(axis=-1) < MIN_FREE] = np.inf
    return gap / np.maximum(np.linalg.norm(changes * is_free, axis=-1), 1e-300)


@lru_cache(maxsize=20)
def _step_gaps(motion: Trajectory) -> dict[str, FloatArray]:
    """Return the gaps to a right step and to those of faults, by key."""
    J, q, e = motion.jacobians, motion.previous, motion.twists(motion.previous)
    R = rotation.to_matrix(tool_pose(motion.inputs, q).rotations)
    start = np.tile(q[0], (len(q), 1))
    twists = {
        "": e,
        "Jacobian in the tool's frame": _both(R, e),
        "error in the tool's frame": _both(np.swapaxes(R, 1, 2), e),
        "rotation error reversed": e * np.repeat([1.0, -1.0], 3),
        "linear and angular swapped": np.roll(e, 3, axis=-1),
        "no feedback": motion.displacements,
    }
    gaps = {key: _step_gap(motion, J, q, twist) for key, twist in twists.items()}
    first = np.repeat(J[:1], len(q), axis=0)
    return gaps | {"frames start anew": _step_gap(motion, first, start, motion.twists(start))}


def _is_step(key: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that move, and those whose step is nearest to that of a fault."""
    gaps = _step_gaps(motion)
    nearest = np.minimum.reduce(list(gaps.values()))
    return Evidence(_is_telling(motion), (gaps[key] == nearest) & (nearest <= SAME_STEP))


def _is_telling(motion: Trajectory) -> BoolArray:
    """Return whether frames begin off their targets and move."""
    is_off = motion.errors(motion.twists(motion.previous)) > LENIENT
    is_off &= motion.case.facts["reachable"]
    return is_off & (np.abs(motion.changes).max(axis=-1) > AT_LIMIT)


def at_limits(motion: Trajectory) -> BoolArray:
    """Return whether joints are at their limits or beyond, (frame, joint)."""
    inputs, q = motion.inputs, motion.q
    return (q >= inputs["upper"] - AT_LIMIT) | (q <= inputs["lower"] + AT_LIMIT)


def _both(R: FloatArray, twists: FloatArray) -> FloatArray:
    """Return twists with both parts rotated by matrices."""
    return np.einsum("fij,fpj->fpi", R, twists.reshape(-1, 2, 3)).reshape(-1, 6)


def _transposed(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames whose step is J' e, with any weight of the rotation."""
    error, is_free = motion.twists(motion.previous), ~at_limits(motion)
    parts = np.einsum("fpij,fpi->fjp", motion.jacobians.reshape(len(error), 2, 3, -1),
                      error.reshape(-1, 2, 3))  # fmt: skip
    spans = map(_spans, parts * is_free[..., None], motion.changes * is_free)
    is_right = _is_step("", motion, laws).explained
    return Evidence(_is_telling(motion), np.array(list(spans)) & ~is_right)


def _spans(columns: FloatArray, vector: FloatArray) -> bool:
    """Return whether a vector is a combination of columns with positive weights."""
    weights = np.linalg.lstsq(columns, vector, rcond=None)[0]
    gap = np.linalg.norm(vector - columns @ weights)
    return bool(gap <= 0.02 * np.linalg.norm(vector) and (weights > 0.0).any())


def _limits_ignored(motion: Trajectory, laws: set[str]) -> Evidence:
    is_beyond = motion.excess.max(axis=-1) > AT_LIMIT
    is_on_target = motion.errors(motion.twists(motion.q)) <= LENIENT
    return Evidence(is_beyond & ("limits kept" in laws), is_on_target)


def _clamped(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that reach their targets if the joints at limits leave these."""
    inputs, q = motion.inputs, motion.q
    at_limit = at_limits(motion)
    is_missed = motion.errors(motion.twists(q)) > LENIENT
    concerned = is_missed & motion.case.facts["reachable"]
    explained = np.zeros(len(q), dtype=bool)
    for i in np.flatnonzero(concerned & at_limit.any(axis=-1)):
        bounds = (np.where(at_limit[i], side, q[i]) for side in (-np.inf, np.inf))
        free = {**inputs, **dict(zip(("lower", "upper"), bounds, strict=True))}
        position, quaternion = (part[i] for part in motion.targets())
        target = Target(position, quaternion, -1)
        solution = solve_ik(mechanism(free), q[i], target, "levenberg_marquardt", restarts=0,
                            tolerance=inputs["tolerance"],
                            tolerance_rotation=inputs["tolerance_rotation"])  # fmt: skip
        frame = motion.errors(motion.twists(np.tile(solution.coordinates, (len(q), 1))))[i]
        explained[i] = frame <= LENIENT
    return Evidence(concerned, explained)


def _wrapped(motion: Trajectory, laws: set[str]) -> Evidence:
    turns = np.abs(np.abs(motion.changes) - 2.0 * np.pi) < WHOLE_TURN
    return _jumping(motion, np.any(turns, axis=-1), least=1)


def _jumping(motion: Trajectory, explained: BoolArray, least: int = MIN_FRAMES) -> Evidence:
    """Return which jumps are explained; a motion has few: each counts several times."""
    is_jump = motion.jumps > 1.0
    repeats = -(-MIN_FRAMES // least)
    return Evidence(np.repeat(is_jump, repeats), np.repeat(explained, repeats))


def _is_singular(motion: Trajectory) -> BoolArray:
    values = np.linalg.svd(motion.jacobians, compute_uv=False)
    return values[:, -1] < SINGULAR * values[:, 0]


def _undamped(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the jumps from near a singularity, or towards a target beyond reach."""
    return _jumping(motion, _is_singular(motion) | ~motion.case.facts["reachable"], least=1)


def _branch(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the jumps between configurations that are both on their targets."""
    is_on_target = motion.errors(motion.twists(motion.q)) <= LENIENT
    before = np.concatenate([is_on_target[:1], is_on_target[:-1]])
    whole = np.abs(np.abs(motion.changes) - 2.0 * np.pi).min(axis=-1) < WHOLE_TURN
    return _jumping(motion, is_on_target & before & ~whole & ~_is_singular(motion))


def _overshoot(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames in which the joints go back on their last movement: g > 1."""
    error = motion.twists(motion.previous)
    step = np.einsum("fij,fj->fi", motion.jacobians, motion.changes)
    before = np.concatenate([motion.changes[:1], motion.changes[:-1]])
    goes_back = (before * motion.changes).sum(-1) < 0.0
    concerned = motion.errors(error) > LENIENT
    beyond = (step * error).sum(-1) > (error * error).sum(-1)
    return Evidence(concerned & (len(laws & {"rest", "target followed"}) > 0), goes_back & beyond)


def _late(motion: Trajectory, shift: int) -> Evidence:
    is_moving = motion.errors(motion.displacements) > LENIENT
    is_missed = motion.errors(motion.twists(motion.q)) > LENIENT
    is_there = motion.errors(motion.twists(motion.q, shift)) <= LENIENT
    return Evidence(is_moving & is_missed, is_there)


def _long_way(motion: Trajectory, laws: set[str]) -> Evidence:
    is_wrong = np.full(len(motion.q), "both signs of a quaternion" in laws)
    return Evidence(is_wrong, is_wrong)


def _time_step(motion: Trajectory, laws: set[str]) -> Evidence:
    is_wrong = np.full(len(motion.q), "velocities and coordinates" in laws)
    return Evidence(is_wrong, is_wrong)


STEP_KEYS = (
    "Jacobian in the tool's frame", "error in the tool's frame", "rotation error reversed",
    "linear and angular swapped", "no feedback", "frames start anew",
)  # fmt: skip
# Steps of single frames, as some families of cases show them.
STEPS: Mapping[str, Signature] = {
    **{key: partial(_is_step, key) for key in STEP_KEYS},
    "transposed Jacobian": _transposed,
    "gain too high": _overshoot,
}
# Frames of all cases; what explains whole poses comes before what explains jumps and misses.
EXACT: Mapping[str, Signature] = {
    "limits ignored": _limits_ignored,
    "one frame late": lambda motion, laws: _late(motion, -1),
    "one frame early": lambda motion, laws: _late(motion, 1),
    "long way round": _long_way,
    "wrong time step": _time_step,
    "clamped after the solve": _clamped,
}
VAGUE: Mapping[str, Signature] = {
    "angles wrapped": _wrapped,
    "undamped": _undamped,
    "another branch": _branch,
}


FAULTS = (*EXACT, *STEPS, *VAGUE)
COUNT = len(FAULTS) + len(MISREADINGS)
