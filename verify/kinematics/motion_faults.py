"""Faults of robots that reach and follow targets: the frames that they explain."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from itertools import islice
from typing import NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.reference.rotation import roll_pitch_yaw
from plumbob.reference.skeleton import Pose

from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from .faults import TABLE, sentences_of
from .formulas import branches, evaluate
from .robot_faults import FAULTS as POSE_FAULTS
from .robot_faults import JACOBIAN_FAULTS
from .robot_models import feature_of, tool_pose
from .robot_readings import POSITION_ONLY, RIGHT, RobotFault
from .robot_targets import HALF_TURNS, LIMIT_STEP, STEP, TOLERANCE
from .robot_textbook import ancestors, rotation_error, sine_error
from .trajectories import (
    AT_LIMIT,
    EXACT,
    LENIENT,
    SAME_SPEED,
    Trajectory,
    is_at_minimum,
    is_falling_at,
    twists_between,
)

# Steps agree if they differ by less than this share, with one of these squared dampings [m^2];
# finer ones are tried where they differ by less than the second; without joints, by the third.
SAME_STEP, COARSE_STEP, MISPLACED = 0.02, 0.2, 0.1
DAMPINGS, FINE = np.geomspace(1e-9, 1.0, 37)[:, None], np.geomspace(0.5, 2.0, 41)[:, None]
FINE_DAMPINGS = np.geomspace(1e-9, 1.0, 401)[:, None, None]
# The right step is preferred if its gap is below the former, or the smallest times the latter.
EQUAL_STEP, NEARER, TIE = 3e-3, 1.5, 1e-6
# Singular values below this share of the largest are small.
SINGULAR = 0.05
# Fewer joints off their limits fit any step, and fewer joints reach no pose in general.
MIN_FREE, POSE_FREEDOMS = 5, 6
# Frames that a fault has to explain before it is named, and the least share of those it concerns.
MIN_FRAMES, MIN_SHARE = 3, 0.5
# The least share of the missed frames that rest where frames are skipped.
MOSTLY = 0.9
# A rotation by about 2 pi: by how much it may differ [rad].
WHOLE_TURN = 0.7
# Steps of some length agree to this share; factors of steps that are too short, dampings that are
# too large [m^2]; a step goes nowhere if the cosine of its angle with the right one is smaller.
SAME_SCALE, SHORT, OVERDAMPED = 0.02, (1e-3, 0.3), np.geomspace(0.3, 1e3, 60)[:, None]
NOWHERE = 0.15
# So many of the Jacobians that a fault may lead to are tried in steps: the others take long.
MAX_JACOBIANS = 3
UNIT_WEIGHTS = np.ones(6)
# Coordinates are well beyond a limit by more than this [rad, m].
WELL_BEYOND = 0.01
SENTENCES = sentences_of("robot_track")
SENTENCES |= {key: fault.sentence for key, fault in (POSE_FAULTS | JACOBIAN_FAULTS).items()}


class Evidence(NamedTuple):
    """Which frames a fault concerns, and which it explains, (frame) each."""

    concerned: BoolArray
    explained: BoolArray


# Returns the frames, given a motion and the laws that it breaks.
Signature = Callable[[Trajectory, set[str]], Evidence]


def diagnosis_of(
    judgements: Sequence[CaseJudgement],
    motions: Mapping[str, Trajectory],
    known: Sequence[str] | None = None,
) -> Diagnosis:
    """Return the fault that explains most of the frames that it concerns, if a law is broken.

    The signatures of a later tier are vaguer: they count where no fault of a tier before does.
    `known` are the faults that explain the program's Jacobian, None if that is right. One that does
    explains a few frames as well; if none does, vague signatures are left out.
    """
    if max((judgement.verdict for judgement in judgements), default=0) < Verdict.WRONG:
        return Diagnosis()
    wrong = [
        (motion, _broken(judgement))
        for judgement in judgements
        if (motion := motions.get(judgement.case.name))
        and (judgement.verdict >= Verdict.WRONG or motion.inputs["max_iterations"] == 1)
    ]
    every = [(motion, set[str]()) for motion in motions.values()]

    @cache
    def has_right_steps() -> bool:
        single = [(motion, laws) for motion, laws in wrong if motion.inputs["max_iterations"] == 1]
        return _share(RIGHT_STEPS, single, False) >= MIN_SHARE

    if explanations := _of_jacobian(known or (), wrong):
        return Diagnosis(explanations)
    for tier in TIERS:
        if tier.is_vague and known is not None:
            continue
        if tier.steps is not None and tier.steps is not has_right_steps():
            continue
        concerned = every if tier.is_of_all else wrong
        shares = {
            key: _share(rule, concerned, tier.by_family)
            for key, rule in tier.signatures.items()
            if known is None or key not in (SYMPTOM, *(JACOBIAN_FAULTS if known else ()))
        }
        key = max(shares, key=shares.__getitem__)
        if shares[key] >= tier.least_share:
            step, whole = DEEPER.get(key, ("", key))
            named = whole if step and _share(STEPS[step], every, True) >= MIN_SHARE else key
            explanation = Explanation((named,), SENTENCES[named], shares[key], 0.0)
            return Diagnosis((explanation,), variant_count=len(FAULTS))
    hints = feature_of(judgements) if known is None else ()
    return Diagnosis(hints=hints, variant_count=len(FAULTS))


def _of_jacobian(
    known: Sequence[str], wrong: Sequence[tuple[Trajectory, set[str]]]
) -> tuple[Explanation, ...]:
    """Return the first fault of the Jacobian that explains poses or single iterations."""
    for key in known:
        signatures = list[Signature]([POSES[key]] if key in POSES else [])
        signatures += [partial(_is_step, key)] if key in STEP_FAULTS else []
        share = max((_share(rule, wrong, True, 1) for rule in signatures), default=0.0)
        if share >= MIN_SHARE:
            return (Explanation((key,), SENTENCES[key], share, 0.0),)
    return ()


def _broken(judgement: CaseJudgement) -> set[str]:
    return {entry.law for entry in judgement.findings if entry.verdict >= Verdict.WRONG}


def _share(
    signature: Signature,
    wrong: Sequence[tuple[Trajectory, set[str]]],
    by_family: bool,
    min_frames: int = MIN_FRAMES,
) -> float:
    """Return the share of the concerned frames that a fault explains, in all cases or the best."""
    families: dict[str, list[Evidence]] = {}
    for motion, laws in wrong:
        family = motion.case.family if by_family else ""
        families.setdefault(family, []).append(signature(motion, laws))
    shares = [0.0]
    for evidence in families.values():
        concerned, explained = (np.concatenate(part) for part in zip(*evidence, strict=True))
        if concerned.sum() >= min_frames:
            shares.append(float((explained & concerned).sum() / concerned.sum()))
    return max(shares)


# ---- poses: the target is reached, as the solver sees it


# Returns the errors to the targets at coordinates as a solver sees them, (frame, 6).
SeenErrors = Callable[[Trajectory, FloatArray], FloatArray]


def _reached(errors_of: SeenErrors, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames in which the tool is on its target as a solver with a fault sees it.

    Of robots with few joints, which reach no target in other kinematics, and of solves that report
    failure, only frames that do count. Zeros, and starts that differ from targets in position or
    rotation alone, tell nothing.
    """
    explained = motion.errors(errors_of(motion, motion.q)) <= LENIENT
    is_pose = explained | (motion.q.shape[1] >= POSE_FREEDOMS and motion.is_claimed is not False)
    is_pose &= motion.q.any(axis=-1) & (motion.case.family != TOLERANCE)
    return Evidence(_ends_off_target(motion) & is_pose, explained)


def _from_other_target(
    formulas: Mapping[str, str], motion: Trajectory, q: FloatArray
) -> FloatArray:
    """Return the twists from tools to other targets than the request's."""
    tool, targets, frames = tool_pose(motion.inputs, q), motion.targets(), np.arange(len(q))
    names = {
        "x": targets.positions, "R": targets.rotations, "tool": rotation.to_matrix(tool.rotations),
        "late": np.maximum(frames - 1, 0), "early": np.minimum(frames + 1, len(q) - 1),
    }  # fmt: skip
    pose = Pose(*(evaluate(formulas[name], names) for name in ("positions", "rotations")))
    return twists_between(tool, pose)


def _ends_off_target(motion: Trajectory) -> BoolArray:
    """Return the frames of solves, not of single steps, that end off their targets."""
    return np.asarray(motion.is_missed & (motion.inputs["max_iterations"] > 1))


def _errors(
    fault: RobotFault,
    angular: Callable[[FloatArray, FloatArray], FloatArray],
    motion: Trajectory,
    q: FloatArray,
) -> FloatArray:
    """Return the displacements and rotations to the target as a solver sees them, (frame, 6)."""
    frames = fault.frames(motion.inputs, q)
    positions, rotations = fault.targets(motion.inputs, motion.targets())
    turned = np.zeros_like(positions)
    if rotations is not None:
        turned = angular(frames.rotation, rotations)
    return np.concatenate([positions - frames.position, turned], axis=-1)


def _sine_if_near(R: FloatArray, goals: FloatArray) -> FloatArray:
    """Return the sine error, which vanishes at half a turn too, or pi beyond a right angle."""
    is_near = np.einsum("fij,fij->f", R, goals) > 1.0
    return np.where(is_near[:, None], sine_error(R, goals), np.pi)


def _in_branch(branch: int, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames off targets, or in a branch of the way from a matrix to a quaternion."""
    poses = tool_pose(motion.inputs, motion.q).rotations, motion.targets().rotations
    is_in = np.any([branches(rotation.to_matrix(pose)) == branch for pose in poses], axis=0)
    is_missed = _ends_off_target(motion)
    concerned = motion.case.facts["reachable"] & (motion.inputs["max_iterations"] > 1)
    return Evidence((is_missed | is_in) & concerned, is_missed & is_in)


def _limits_ignored(motion: Trajectory, laws: set[str]) -> Evidence:
    is_beyond = motion.excess.max(axis=-1) > AT_LIMIT
    return Evidence(is_beyond & ("limits kept" in laws), ~motion.is_off_target)


def _from_zero(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames with angles between 0 and 2 pi that are within limits a turn before."""
    q, is_beyond = motion.q, motion.excess > AT_LIMIT
    is_turned = (q >= 0.0) & (q < 2.0 * np.pi) & (q - 2.0 * np.pi >= motion.inputs["lower"])
    is_negative = (q < 0.0) & ~motion.inputs["slides"]
    explained = (is_turned | ~is_beyond).all(axis=-1) & ~is_negative.any(axis=-1)
    return Evidence(np.asarray(is_beyond.any(axis=-1)), np.asarray(explained))


def _clamped(motion: Trajectory, laws: set[str]) -> Evidence:
    return Evidence(_ends_off_target(motion) & motion.at_limits.any(axis=-1), motion.is_clamped)


def _claimed(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the targets beyond reach that are said to be reached."""
    is_beyond = ~motion.case.facts["reachable"] & ("claims" in laws)
    return Evidence(is_beyond, np.full(len(is_beyond), motion.is_claimed is True))


def _stopped(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that end while the error still falls."""
    concerned = _ends_off_target(motion) & motion.is_pose
    return Evidence(concerned, np.full(len(motion.q), is_falling_at(motion)))


def _accepted(test: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the starts off their targets that the answers or another test accept."""
    p, r = np.linalg.norm(motion.twists(motion.previous).reshape(-1, 2, 3), axis=-1).T
    tp, tr = (motion.inputs[name] for name in ("tolerance", "tolerance_rotation"))
    is_accepted = np.abs(motion.changes).max(axis=-1) <= EXACT
    is_accepted &= motion.is_claimed is not False
    is_passed = np.asarray(evaluate(test, {"p": p, "r": r, "tp": tp, "tr": tr}))
    concerned = (is_accepted | is_passed) & ((p > tp) | (r > tr))
    return Evidence(concerned & (motion.case.family == TOLERANCE), is_accepted == is_passed)


def _within(limits: Sequence[str], motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames well beyond limits, and those in which joints keep other limits.

    Frames that keep them without a joint just at one tell nothing, nor do whole turns.
    """
    inputs, joints = motion.inputs, np.arange(motion.q.shape[1])
    names = {**inputs, "first": joints == 0, "last": joints == joints[-1]}
    ends = [evaluate(limit, names) for limit in limits]  # reversed ones keep joints at either
    beyond = np.maximum(np.minimum(*ends) - motion.q, motion.q - np.maximum(*ends))
    middle = 0.5 * (inputs["lower"] + inputs["upper"])
    wrapped = motion.q - 2.0 * np.pi * np.round((motion.q - middle) / (2.0 * np.pi))
    is_wrapped = np.abs(np.clip(wrapped, inputs["lower"], inputs["upper"]) - wrapped) <= EXACT
    is_seen = (motion.excess * ~is_wrapped).max(axis=-1) > WELL_BEYOND
    is_told, is_kept = (np.abs(beyond) <= EXACT).any(axis=-1), (beyond <= EXACT).all(axis=-1)
    return Evidence(is_seen & (is_told | ~is_kept), is_kept)


def _within_speeds(limits: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that are too fast, and those in which joints keep other greatest speeds."""
    if "velocity_limits" not in motion.inputs:
        return Evidence(*np.zeros((2, len(motion.q)), dtype=bool))
    h, speeds = motion.inputs["h"], motion.inputs["velocity_limits"]
    steps = h * evaluate(limits, {"v": speeds, "h": h}) - np.abs(motion.changes)
    is_told = (np.abs(steps) <= EXACT).any(axis=-1)
    is_fast = (np.abs(motion.changes) > h * speeds + EXACT).any(axis=-1)
    is_kept = (steps >= -EXACT).all(axis=-1)
    return Evidence(is_fast & (is_told | ~is_kept), is_kept)


def _speeds(speeds: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames with the reported speeds of a fault."""
    if motion.velocities is None or "velocities and coordinates" not in laws:
        return Evidence(*np.zeros((2, len(motion.q)), dtype=bool))
    names = {**motion.inputs, "q": motion.q, "v": motion.changes / motion.inputs["h"]}
    expected = evaluate(speeds, names)
    gaps = np.abs(motion.velocities - expected).max(axis=-1)
    scale = np.abs(motion.changes).max(axis=-1) / motion.inputs["h"]
    return Evidence(scale > 0.0, gaps <= SAME_SPEED * np.maximum(scale, np.abs(expected).max(-1)))


def _of_other_step(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return all frames of a motion with velocities that are its changes times a single factor."""
    evidence, d, v = (
        _by_law("velocities and coordinates", motion, laws),
        motion.changes,
        motion.velocities,
    )
    if v is None or not d.any():
        return evidence
    gaps = np.abs(v - (v * d).sum() / (d * d).sum() * d).max(axis=-1)
    return evidence._replace(explained=evidence.explained & (gaps <= SAME_SPEED * np.abs(v).max()))


def _skipped(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the missed frames without movement, if these are those in which targets move least.

    Frames that move reach their targets.
    """
    distances = np.linalg.norm(motion.displacements[:, :3], axis=-1)
    is_still = np.abs(motion.changes).max(axis=-1) <= EXACT
    is_slow = distances <= distances[is_still].max(initial=-1.0)
    is_told = (is_slow == is_still)[1:].all() and (distances.max() <= EXACT or not is_still.all())
    is_missed = _ends_off_target(motion) & (not motion.is_pose)
    is_told &= bool(is_still[is_missed].mean() >= MOSTLY) if is_missed.any() else False
    return Evidence(is_missed, is_still & is_told)


def _rejected(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames off targets without movement, where all that move are on their targets."""
    is_still = np.abs(motion.changes).max(axis=-1) <= EXACT
    is_told = not (motion.is_off_target & ~is_still).any() and motion.is_off_target.any()
    return Evidence(motion.is_off_target & (not motion.is_pose), is_still & is_told)


def _by_law(law: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return all frames of a motion that breaks a law."""
    is_wrong = np.full(len(motion.q), law in laws)
    return Evidence(is_wrong, is_wrong)


# ---- steps


def _step_gap(motion: Trajectory, J: FloatArray, q: FloatArray, twists: FloatArray) -> FloatArray:
    """Return how far frames are from a damped step from q along twists, of any length, (frame).

    Relative to the step; joints that end at a limit are left out.
    """
    is_free = ~motion.at_limits
    changes, dampings = (motion.q - q) * is_free, DAMPINGS
    lengths = np.maximum(np.linalg.norm(changes, axis=-1), 1e-300)
    for fine in (FINE, None):
        steps = damped_steps(J, twists, dampings) * is_free[:, None]
        gaps = _gaps(changes, steps, (0.0, np.inf)) / lengths[:, None]
        nearest = gaps.argmin(axis=-1)
        if fine is None or (gaps.min(axis=-1) > COARSE_STEP).all():
            break
        dampings = DAMPINGS[nearest][:, None] * fine
    gap = gaps.min(axis=-1)
    gap[is_free.sum(axis=-1) < MIN_FREE] = np.inf
    return np.asarray(gap)


def damped_steps(J: FloatArray, twists: FloatArray, dampings: FloatArray) -> FloatArray:
    """Return the steps J' (J J' + damping I)^-1 e along twists e, (frame, damping, joint)."""
    values, U = np.linalg.eigh(J @ np.swapaxes(J, 1, 2))
    parts = np.einsum("fij,fi->fj", U, twists)[:, None]
    parts = parts / (np.maximum(values, 0.0)[:, None] + dampings)
    return np.asarray(np.einsum("fij,fik,fdk->fdj", J, U, parts))


def _wrongly_solved(solutions: Sequence[str], motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the single iterations that solve the equation of their step in the way of a fault.

    The equation A p = b is that of the tool's freedoms or that of the joints; A = L L^T.
    """
    J, e, changes = motion.jacobians, motion.twists(motion.previous), motion.changes
    is_single = np.abs(changes).max(axis=-1) > AT_LIMIT
    is_single &= (motion.inputs["max_iterations"] == 1) & ~motion.at_limits.any(axis=-1)
    transposed, pull = np.swapaxes(J, 1, 2), np.einsum("fij,fi->fj", J, e)
    gaps = [np.full(len(changes), np.inf)]
    for M, b in ((J @ transposed, e), (transposed @ J, pull)) if is_single.any() else ():
        A = M[:, None] + FINE_DAMPINGS * np.eye(M.shape[-1])
        names = {"A": A, "L": np.linalg.cholesky(A), "b": np.broadcast_to(b[:, None], A.shape[:-1])}
        for solution in solutions:
            p = evaluate(solution, names)
            steps = p if b is pull else np.einsum("fij,fdi->fdj", J, p)
            gaps.append(_gaps(changes, steps, (0.0, np.inf)).min(axis=-1))
    is_near = np.min(gaps, axis=0) <= SAME_STEP * np.linalg.norm(changes, axis=-1)
    return Evidence(is_single & (changes.shape[-1] >= MIN_FREE), is_near)


def _gaps(changes: FloatArray, steps: FloatArray, factors: tuple[float, float]) -> FloatArray:
    """Return distances of changes from steps times a factor in a range, (frame, damping)."""
    lengths = np.maximum((steps * steps).sum(axis=-1), 1e-300)
    scales = np.clip(np.einsum("fdj,fj->fd", steps, changes) / lengths, *factors)
    return np.asarray(np.linalg.norm(changes[:, None] - scales[..., None] * steps, axis=-1))


def _scaled(
    dampings: FloatArray, factors: tuple[float, float], motion: Trajectory, laws: set[str]
) -> Evidence:
    """Return the frames that are right steps with some of these dampings, times a factor."""
    J, changes = motion.jacobians * ~motion.at_limits[:, None], motion.changes * ~motion.at_limits
    steps = damped_steps(J, motion.twists(motion.previous), dampings)
    lengths = np.linalg.norm(changes, axis=-1)
    is_single = motion.inputs["max_iterations"] == 1 and changes.shape[1] >= MIN_FREE
    is_close = _gaps(changes, steps, factors).min(axis=-1) <= SAME_SCALE * lengths
    return Evidence((lengths > AT_LIMIT) & is_single, is_close)


def _is_stuck(key: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that end off the minimum, and where a fault's step goes nowhere.

    A solver that accepts only steps that reduce the error ends where its own do not; a frame that
    its step leaves at the start tells nothing.
    """
    (J,) = RIGHT.jacobians(motion.inputs, motion.q)
    J = J * ~motion.at_limits[:, None]
    twists = motion.twists(motion.q), _wrong_twists(motion, motion.q, TWISTS[key])
    right, wrong = (np.einsum("fij,fi->fj", J, twist) for twist in twists)
    scale = np.linalg.norm(right, axis=-1) * np.linalg.norm(wrong, axis=-1)
    cosine = (right * wrong).sum(axis=-1) / np.maximum(scale, 1e-300)
    is_left = (np.abs(motion.changes).max(axis=-1) <= AT_LIMIT) & (cosine < 0.0)
    concerned = _ends_off_target(motion) & motion.is_pose & ~is_at_minimum(motion) & ~is_left
    return Evidence(concerned, np.abs(cosine) <= NOWHERE)


def _step_gaps(motion: Trajectory) -> dict[str, FloatArray]:
    """Return the gaps to a right step and to steps of faults, by key."""
    J, q, e = motion.jacobians, motion.previous, motion.twists(motion.previous)
    twists = {key: _wrong_twists(motion, q, formula) for key, formula in TWISTS.items()}
    if len(q) > 1:
        twists["no feedback"] = motion.displacements
    gaps = {key: _step_gap(motion, J, q, twist) for key, twist in twists.items()}
    in_position = np.repeat([1.0, 0.0], 3)
    gaps[POSITION_ONLY] = np.minimum(
        *(
            _step_gap(motion, J * rows[:, None], q, e * in_position)
            for rows in (in_position, UNIT_WEIGHTS)
        )
    )
    is_right = (gaps[""] <= EQUAL_STEP).all()
    if motion.inputs["max_iterations"] == 1 and not is_right:
        is_half_turn = motion.case.family.startswith(HALF_TURNS)
        for key, fault in STEP_FAULTS.items():
            if fault.rules.keys() & {"end", "seen"} if is_half_turn else "seen" not in fault.rules:
                gaps[key] = np.minimum.reduce(list(_fault_gaps(fault, motion)))
    if len(q) > 1:
        first, start = np.repeat(J[:1], len(q), axis=0), np.tile(q[0], (len(q), 1))
        gaps["frames start anew"] = _step_gap(motion, first, start, motion.twists(start))
    return gaps


def _wrong_twists(motion: Trajectory, q: FloatArray, formula: str) -> FloatArray:
    """Return the twists to the targets that a fault makes of the right ones, (frame, 6)."""
    R = RIGHT.frames(motion.inputs, q).rotation
    angles = _angles_between(R, motion.targets().rotations)
    names = {"e": motion.twists(q), "R": R, "along": _both, "angles": angles}
    return np.asarray(evaluate(formula, names))


def _angles_between(R: FloatArray, goals: FloatArray) -> FloatArray:
    """Return the differences of roll, pitch and yaw from matrices to quaternions, (frame, 3)."""
    pairs = zip(R, rotation.to_matrix(goals), strict=True)
    return np.array([np.subtract(roll_pitch_yaw(b), roll_pitch_yaw(a)) for a, b in pairs])


def _fault_gaps(fault: RobotFault, motion: Trajectory) -> Iterator[FloatArray]:
    """Yield the gaps to steps with a fault's Jacobians, and rotation vectors or sines."""
    q = motion.previous
    angulars = [rotation_error, sine_error] if len(q) == 1 else [rotation_error]
    errors = [_errors(fault, angular, motion, q) for angular in angulars]
    for J in islice(fault.jacobians(motion.inputs, q), MAX_JACOBIANS):
        yield from (_step_gap(motion, J, q, error) for error in errors)


@lru_cache(maxsize=200)
def _nearest_steps(motion: Trajectory) -> Mapping[str, Evidence]:
    """Return the frames that move from off their targets, and those of the nearest step, by key.

    Right steps that a fault does not change tell nothing of it.
    """
    is_off = motion.errors(motion.twists(motion.previous)) > LENIENT
    is_telling = is_off & motion.case.facts["reachable"] & (motion.case.family != LIMIT_STEP)
    is_telling &= np.abs(motion.changes).max(axis=-1) > AT_LIMIT
    is_telling &= (~motion.at_limits).sum(axis=-1) >= MIN_FREE
    gaps = _step_gaps(motion) if is_telling.any() else {"": np.full(len(motion.q), np.inf)}
    keys, table = list(gaps), np.array(list(gaps.values()))
    is_right = (gaps[""] <= SAME_STEP) & (
        gaps[""] <= np.maximum(EQUAL_STEP, NEARER * table.min(axis=0))
    )
    table[0] = np.where(is_right, 0.0, table[0])
    is_nearest = (table <= table.min(axis=0) + TIE) & (table <= SAME_STEP)
    is_nearest[1:] &= ~is_nearest[0]
    evidence = {
        key: Evidence(is_telling, is_near) for key, is_near in zip(keys, is_nearest, strict=True)
    }
    for key, fault in STEP_FAULTS.items():
        if not fault.changes(motion.inputs):
            evidence[key] = Evidence(is_telling & ~is_nearest[0], is_telling & False)
    return evidence


def _is_step(key: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that move, and where the step is nearest to that of a fault."""
    evidence = _nearest_steps(motion)
    return evidence.get(key, Evidence(evidence[""].concerned, np.zeros(len(motion.q), dtype=bool)))


def _single_step(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that make exactly a single right step though more are allowed."""
    concerned, q = _ends_off_target(motion) & motion.is_pose, motion.previous
    gaps = _step_gap(motion, motion.jacobians, q, motion.twists(q)) if concerned.any() else np.inf
    is_moved = np.abs(motion.changes).max(axis=-1) > AT_LIMIT
    return Evidence(concerned, is_moved & (gaps <= EQUAL_STEP))


def _posture_added(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that are right steps plus a pull to a posture that moves the tool.

    In the null space of the Jacobian, N, steps show the pull alone: N' dq = a N' (c - q), which
    gives its gain a and the posture c, but for joints that the null space does not move.
    """
    is_free = ~motion.at_limits.any(axis=-1) & (np.abs(motion.changes).max(axis=-1) > AT_LIMIT)
    is_redundant = motion.q.shape[1] > POSE_FREEDOMS and motion.inputs["max_iterations"] == 1
    nothing = np.zeros(len(motion.q), dtype=bool)
    if not is_redundant or is_free.sum() < 2 * motion.q.shape[1]:
        return Evidence(nothing, nothing)
    N = np.linalg.svd(motion.jacobians)[2][:, POSE_FREEDOMS:]
    columns = np.concatenate([N, -np.einsum("fnj,fj->fn", N, motion.previous)[..., None]], axis=-1)
    moves = np.einsum("fnj,fj->fn", N, motion.changes)
    A, b = columns[is_free].reshape(-1, columns.shape[-1]), moves[is_free].ravel()
    pull, gain = np.split(np.linalg.lstsq(A, b, rcond=None)[0], [-1])
    J, q, e = motion.jacobians, motion.previous, motion.twists(motion.previous)
    is_shown, gaps = np.abs(A[:, :-1]).max(axis=0) > AT_LIMIT, np.full(len(q), np.inf)
    middle = 0.5 * (motion.inputs["lower"] + motion.inputs["upper"])
    for posture in (middle, np.zeros_like(middle), motion.inputs["start"]):
        pulls = np.where(is_shown, pull, gain * posture) - gain * q
        gaps = np.minimum(gaps, _step_gap(replace(motion, q=motion.q - pulls), J, q, e))
    is_right = _step_gap(motion, J, q, e) <= SAME_STEP
    return Evidence(is_free & ~is_right, gaps <= SAME_STEP)


def _misplaced(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the single iterations that a shorter step, without some joints, explains.

    Left out are joints that do not move the tool, and one that is held at its limit.
    """
    is_free = ancestors(motion.inputs) > 0.0
    facts = motion.case.facts
    if "held" in facts and not facts["is_leaving"]:
        is_free[facts["held"]] = False
    is_moved = np.abs(motion.changes) > AT_LIMIT
    is_single = motion.case.family in (STEP, LIMIT_STEP) and not is_free.all()
    concerned = np.array(is_single & is_moved.any(axis=-1)) & (np.arange(len(motion.q)) == 0)
    is_first = np.arange(len(is_free)) < is_free.sum()
    is_as_meant = (is_moved == is_first) | motion.at_limits  # joints are clamped after the step
    steps = np.zeros((len(motion.q), len(DAMPINGS), len(is_free)))
    steps[..., is_first] = damped_steps(
        motion.jacobians[..., is_free], motion.twists(motion.previous), DAMPINGS
    )
    changes, steps = motion.changes * ~motion.at_limits, steps * ~motion.at_limits[:, None]
    gaps = _gaps(changes, steps, (0.0, np.inf)).min(axis=-1)
    is_step = gaps <= MISPLACED * np.linalg.norm(changes, axis=-1)
    return Evidence(concerned, is_as_meant.all(axis=-1) & is_step)


def _both(R: FloatArray, twists: FloatArray) -> FloatArray:
    """Return twists with both parts rotated by matrices."""
    return np.einsum("fij,fpj->fpi", R, twists.reshape(-1, 2, 3)).reshape(-1, 6)


def _transposed(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames whose step is J' e, with any weight of the rotation."""
    error, is_free = motion.twists(motion.previous), ~motion.at_limits
    parts = np.einsum("fpij,fpi->fjp", motion.jacobians.reshape(len(error), 2, 3, -1),
                      error.reshape(-1, 2, 3))  # fmt: skip
    spans = map(_spans, parts * is_free[..., None], motion.changes * is_free)
    is_right = _is_step("", motion, laws).explained | (motion.q.shape[1] < MIN_FREE)
    return Evidence(_nearest_steps(motion)[""].concerned, np.array(list(spans)) & ~is_right)


def _spans(columns: FloatArray, vector: FloatArray) -> bool:
    """Return whether a vector is a combination of columns with positive weights."""
    weights = np.linalg.lstsq(columns, vector, rcond=None)[0]
    gap = np.linalg.norm(vector - columns @ weights)
    return bool(gap <= 0.02 * np.linalg.norm(vector) and (weights > 0.0).any())


def _overshoot(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames in which the joints go back on their last movement: g > 1."""
    error = motion.twists(motion.previous)
    step = np.einsum("fij,fj->fi", motion.jacobians, motion.changes)
    before = np.concatenate([motion.changes[:1], motion.changes[:-1]])
    goes_back = (before * motion.changes).sum(-1) < 0.0
    concerned = motion.errors(error) > LENIENT
    beyond = (step * error).sum(-1) > (error * error).sum(-1)
    return Evidence(concerned & (len(laws & {"rest", "target followed"}) > 0), goes_back & beyond)


# ---- jumps


def _wrapped(motion: Trajectory, laws: set[str]) -> Evidence:
    turns = np.abs(np.abs(motion.changes) - 2.0 * np.pi) < WHOLE_TURN
    return _jumping(motion, np.any(turns, axis=-1), repeats=MIN_FRAMES)


def _jumping(motion: Trajectory, explained: BoolArray, repeats: int = 1) -> Evidence:
    """Return which jumps are explained; where a single one is enough, each counts several times."""
    return Evidence(np.repeat(motion.jumps > 1.0, repeats), np.repeat(explained, repeats))


def _is_singular(motion: Trajectory) -> BoolArray:
    values = np.linalg.svd(motion.jacobians, compute_uv=False)
    return values[:, -1] < SINGULAR * values[:, 0]


def _undamped(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the jumps from near a singularity, or towards a target beyond reach.

    Other frames that are off their targets have another reason.
    """
    explained = _is_singular(motion) | ~motion.case.facts["reachable"]
    concerned = ((motion.jumps > 1.0) | motion.is_missed) & (motion.jumps > 1.0).any()
    return Evidence(np.repeat(concerned, MIN_FRAMES), np.repeat(explained, MIN_FRAMES))


def _branch(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the jumps between configurations that are both on their targets."""
    is_on_target = ~motion.is_off_target
    before = np.concatenate([is_on_target[:1], is_on_target[:-1]])
    whole = np.abs(np.abs(motion.changes) - 2.0 * np.pi).min(axis=-1) < WHOLE_TURN
    return _jumping(motion, is_on_target & before & ~whole & ~_is_singular(motion))


class Tier(NamedTuple):
    """Signatures that are as telling as each other."""

    signatures: Mapping[str, Signature]
    by_family: bool = False  # whether the family of cases that shows a fault best decides
    least_share: float = MIN_SHARE
    is_vague: bool = False  # whether they are symptoms, which wrong kinematics may have
    steps: bool | None = None  # whether single iterations have to be right, if that matters
    is_of_all: bool = False  # whether right answers count as well


def _entries(field: str, make: Callable[..., Evidence]) -> dict[str, Signature]:
    """Return the signatures of the faults that have a field in the catalogue."""
    entries = (TABLE["robot_track"] | TABLE["robots"]).items()
    return {key: partial(make, entry[field]) for key, entry in entries if field in entry}


# The right twists e of tools, and those of faults.
TWISTS: Mapping[str, str] = {"": "e"} | {
    key: entry["twist"] for key, entry in TABLE["robot_track"].items() if "twist" in entry
}
STEP_FAULTS = {
    key: fault
    for key, fault in (POSE_FAULTS | JACOBIAN_FAULTS).items()
    if not (fault.relative or fault.order
            or key in ("columns negated", "lever arms reversed", POSITION_ONLY))
}  # fmt: skip
STEP_KEYS = (*(key for key in TWISTS if key), POSITION_ONLY, "no feedback", "frames start anew",
             *STEP_FAULTS)  # fmt: skip
RIGHT_STEPS: Signature = partial(_is_step, "")
APPARENT: Mapping[str, Signature] = {
    key: partial(_reached, partial(_errors, fault, _sine_if_near))
    for key, fault in POSE_FAULTS.items()
}
TARGETS = _entries("target", lambda target, *motion: _reached(
    partial(_from_other_target, target), *motion))  # fmt: skip
# What explains whole poses comes before what explains steps, jumps and misses.
SYMPTOM = "slow frames skipped"  # wrong Jacobians may leave frames as they are as well
POSES: Mapping[str, Signature] = {
    SYMPTOM: _skipped,  # rotations of the first target, if positions rest
    "missed frames kept": _rejected,
    "angles from zero": _from_zero,
    "limits ignored": _limits_ignored,
    **TARGETS,
    "long way round": partial(_by_law, "both signs of a quaternion"),
    **_entries("speeds", _speeds),
    "wrong time step": _of_other_step,
    "clamped after the solve": _clamped,
    **{key: signature for key, signature in APPARENT.items() if key != POSITION_ONLY},
}  # fmt: skip
STEPS: Mapping[str, Signature] = {
    "damping too large": partial(_scaled, OVERDAMPED, (0.9, 1.1)),
    "steps too short": partial(_scaled, DAMPINGS[DAMPINGS < 0.1][:, None], SHORT),
    "transposed Jacobian": _transposed,  # as with small columns and large damping
    **{key: partial(_is_step, key) for key in STEP_KEYS},
    "steps of other joints": _misplaced,
    "posture added": _posture_added,
    "single step": _single_step,
    "gain too high": _overshoot,
}
VAGUE: Mapping[str, Signature] = {
    "angles wrapped": _wrapped,
    "undamped": _undamped,
    "another branch": _branch,
    "success always claimed": _claimed,
    "stopped early": _stopped,
}
STUCK: Mapping[str, Signature] = {
    key: partial(_is_stuck, key)
    for key in (
        "rotation error reversed", "position error reversed", "error in the tool's frame",
        "rotation error in the tool's frame", "difference of Euler angles",
    )
}  # fmt: skip
# Joints in another order leave their limits, but reach their targets.
ORDERS: Mapping[str, Signature] = {k: POSES[k] for k, fault in POSE_FAULTS.items() if fault.order}
# Faults that steps show to be part of another: the key of the steps, and that of the other.
DEEPER = {"velocities from the start": ("frames start anew", "coordinates not kept")}
TIERS: Sequence[Tier] = (
    Tier(ORDERS, least_share=0.95),
    Tier(_entries("limits", _within) | _entries("speed_limits", _within_speeds), False, 0.97),
    Tier(_entries("test", _accepted), least_share=0.97, is_of_all=True, steps=True),
    Tier({SYMPTOM: _skipped} | TARGETS, least_share=0.9),  # other targets make other velocities
    Tier(POSES),
    Tier(STEPS, by_family=True),
    Tier(_entries("solution", _wrongly_solved), least_share=0.9, steps=False),
    Tier(_entries("branch", _in_branch), least_share=0.97, is_of_all=True),
    Tier(STUCK, by_family=True, least_share=0.65, is_vague=True, steps=False),
    Tier({"rotation missed": APPARENT[POSITION_ONLY]}, is_vague=True, steps=False),
    Tier(VAGUE, is_vague=True),
)
FAULTS = tuple(dict.fromkeys(key for tier in TIERS for key in tier.signatures))
