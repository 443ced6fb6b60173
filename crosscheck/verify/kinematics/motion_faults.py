"""Faults of robots that reach and follow targets: the frames that they explain."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray

from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from .faults import sentences_of
from .robot_faults import FAULTS as POSE_FAULTS
from .robot_faults import JACOBIAN_FAULTS, POSITION_ONLY, RIGHT, RobotFault
from .robot_textbook import roll_pitch_yaw, rotation_error, sine_error
from .trajectories import AT_LIMIT, LENIENT, Trajectory

# Steps agree if they differ by less than this share, with one of these squared dampings [m^2].
SAME_STEP, DAMPINGS = 0.05, np.geomspace(1e-9, 1.0, 37)[:, None]
# The right step is preferred if its gap is below the former, or the smallest times the latter.
EQUAL_STEP, NEARER = 1e-3, 1.5
# Singular values below this share of the largest are small.
SINGULAR = 0.05
# Fewer joints off their limits fit any step, and fewer joints reach no pose in general.
MIN_FREE, POSE_FREEDOMS = 5, 6
# An error is least where its gradient is this small, relative to error and Jacobian.
STATIONARY = 0.01
# Frames that a fault has to explain before it is named, and the least share of those it concerns.
MIN_FRAMES, MIN_SHARE = 3, 0.5
# A rotation by about 2 pi: by how much it may differ [rad].
WHOLE_TURN = 0.7
# Errors that fall to less than this share have been reduced.
REDUCED = 0.9
# Steps of some length agree to this share; factors of steps that are too short, dampings that are
# too large [m^2]; a step goes nowhere if the cosine of its angle with the right one is smaller.
SAME_SCALE, SHORT, OVERDAMPED = 0.02, (1e-3, 0.3), np.geomspace(0.3, 1e3, 60)[:, None]
NOWHERE = 0.15
# Coordinates are well beyond a limit by more than this [rad, m].
WELL_BEYOND = 0.01
# Coordinates that are at a limit are so near to it [rad, m]; speeds agree to this share.
EXACT, SAME_SPEED = 1e-9, 1e-3
# A test that is looser than the tolerance lets pass up to so many tolerances.
LOOSER = 60.0
SENTENCES = sentences_of("robot_track")
SENTENCES |= {key: fault.sentence for key, fault in (POSE_FAULTS | JACOBIAN_FAULTS).items()}


class Evidence(NamedTuple):
    """Which frames a fault concerns, and which it explains, (frame) each."""

    concerned: BoolArray
    explained: BoolArray


# Returns whether errors pass, given displacements and angles, (frame, 2), and their tolerances.
TestOfErrors = Callable[[FloatArray, FloatArray], BoolArray]
# Returns the frames, given a motion and the laws that it breaks.
Signature = Callable[[Trajectory, set[str]], Evidence]


def diagnosis_of(
    judgements: Sequence[CaseJudgement], motions: Mapping[str, Trajectory]
) -> Diagnosis:
    """Return the fault that explains most of the frames that it concerns, if a law is broken.

    The signatures of a later tier are vaguer: they count where no fault of a tier before does.
    """
    if max((judgement.verdict for judgement in judgements), default=0) < Verdict.WRONG:
        return Diagnosis()
    wrong = [
        (motion, _broken(judgement))
        for judgement in judgements
        if (motion := motions.get(judgement.case.name))
        and (judgement.verdict >= Verdict.WRONG or motion.inputs["max_iterations"] == 1)
    ]
    for signatures, by_family, least in TIERS:
        shares = {key: _share(rule, wrong, by_family) for key, rule in signatures.items()}
        key = max(shares, key=shares.__getitem__)
        if shares[key] >= least:
            explanation = Explanation((key,), SENTENCES[key], shares[key], 0.0)
            return Diagnosis((explanation,), variant_count=len(FAULTS))
    return Diagnosis(variant_count=len(FAULTS))


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


# ---- poses: the target is reached, as the solver sees it


def _reached(fault: RobotFault, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames in which a fault's kinematics reach the target.

    Of robots with few joints, which reach no target in other kinematics, and of solves that report
    failure, only frames that do count.
    """
    explained = motion.errors(_errors(fault, motion, motion.q, _sine_if_near)) <= LENIENT
    is_pose = explained | (motion.q.shape[1] >= POSE_FREEDOMS and motion.is_claimed is not False)
    return Evidence(_ends_off_target(motion) & is_pose, explained)


def _ends_off_target(motion: Trajectory) -> BoolArray:
    """Return the frames of solves, not of single steps, that end off their targets."""
    return np.asarray(motion.is_missed & (motion.inputs["max_iterations"] > 1))


def _errors(
    fault: RobotFault,
    motion: Trajectory,
    q: FloatArray,
    angular: Callable[[FloatArray, FloatArray], FloatArray] = rotation_error,
) -> FloatArray:
    """Return the displacements and rotations to the target as a solver sees them, (frame, 6)."""
    frames, targets = fault.frames(motion.inputs, q), fault.targets(motion.inputs, motion.targets())
    turned = np.zeros_like(targets.positions)
    if targets.rotations is not None:
        turned = angular(frames.rotation, rotation.to_matrix(targets.rotations))
    return np.concatenate([targets.positions - frames.position, turned], axis=-1)


def _sine_if_near(R: FloatArray, goals: FloatArray) -> FloatArray:
    """Return the sine error, which vanishes at half a turn too, or pi beyond a right angle."""
    is_near = np.einsum("fij,fij->f", R, goals) > 1.0
    return np.where(is_near[:, None], sine_error(R, goals), np.pi)


def is_falling_at(motion: Trajectory) -> bool:
    """Return whether the error of a pose has fallen from the start and can fall further."""
    before, after = (np.linalg.norm(motion.twists(q), axis=-1) for q in (motion.previous, motion.q))
    return bool(((after < REDUCED * before) & ~_is_at_minimum(motion)).any())


def _is_at_minimum(motion: Trajectory) -> BoolArray:
    """Return whether no joint off its limits would reduce the error, (frame)."""
    e, J = motion.twists(motion.q), next(RIGHT.jacobians(motion.inputs, motion.q))
    J = J * ~motion.at_limits[:, None, :]
    gradient = np.linalg.norm(np.einsum("fij,fi->fj", J, e), axis=-1)
    scale = np.linalg.norm(J, axis=(1, 2)) * np.linalg.norm(e, axis=-1)
    return np.asarray(gradient <= STATIONARY * scale)


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
    return Evidence(motion.is_missed & motion.at_limits.any(axis=-1), motion.is_clamped)


def _claimed(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the targets beyond reach that are said to be reached."""
    is_beyond = ~motion.case.facts["reachable"] & ("claims" in laws)
    return Evidence(is_beyond, np.full(len(is_beyond), motion.is_claimed is True))


def _stopped(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that end while the error still falls."""
    concerned = _ends_off_target(motion) & motion.is_pose
    return Evidence(concerned, np.full(len(motion.q), is_falling_at(motion)))


def _with_another_tolerance(
    is_enough: TestOfErrors, motion: Trajectory, laws: set[str]
) -> Evidence:
    """Return the poses that end off the target with a report of success, and pass a test."""
    errors = np.linalg.norm(motion.twists(motion.q).reshape(-1, 2, 3), axis=-1)
    concerned = motion.errors(motion.twists(motion.q)) > 1.0
    concerned &= motion.case.facts["reachable"] & (motion.inputs["max_iterations"] > 1)
    concerned &= motion.is_pose & (motion.is_claimed is True)
    tolerances = np.array([motion.inputs["tolerance"], motion.inputs["tolerance_rotation"]])
    return Evidence(concerned, np.asarray(is_enough(errors, tolerances).all(axis=-1)))


def _one_sided(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames with joints beyond limits on one side, and at limits on the other."""
    q, (lower, upper) = motion.q, (motion.inputs["lower"], motion.inputs["upper"])
    is_low, is_high = (x.any(axis=-1) for x in (q <= lower + EXACT, q >= upper - EXACT))
    is_below, is_above = (x.any(axis=-1) for x in (q < lower - AT_LIMIT, q > upper + AT_LIMIT))
    explained = (is_below & is_high & ~is_above) | (is_above & is_low & ~is_below)
    return Evidence(np.asarray((is_below & is_high) | (is_above & is_low)), np.asarray(explained))


def _within(
    limits: Callable[[Trajectory], tuple[FloatArray, FloatArray]],
    motion: Trajectory,
    laws: set[str],
) -> Evidence:
    """Return the frames well beyond limits, and those in which joints keep other limits."""
    lower, upper = limits(motion)
    is_within = (motion.q >= lower - EXACT) & (motion.q <= upper + EXACT)
    is_beyond = motion.excess.max(axis=-1) > WELL_BEYOND
    return Evidence(is_beyond & motion.is_pose, np.asarray(is_within.all(axis=-1)))


def _speeds(key: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames whose reported speeds are those of a fault."""
    if motion.velocities is None or "velocities and coordinates" not in laws:
        return Evidence(*np.zeros((2, len(motion.q)), dtype=bool))
    expected = SPEEDS[key](motion.changes / motion.inputs["h"], motion)
    gaps = np.abs(motion.velocities - expected).max(axis=-1)
    scale = np.abs(motion.changes).max(axis=-1) / motion.inputs["h"]
    return Evidence(scale > 0.0, gaps <= SAME_SPEED * np.maximum(scale, np.abs(expected).max(-1)))


def _late(motion: Trajectory, shift: int) -> Evidence:
    is_moving = motion.errors(motion.displacements) > LENIENT
    is_there = motion.errors(motion.twists(motion.q, shift)) <= LENIENT
    return Evidence(is_moving & motion.is_off_target, is_there)


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
    changes, steps = (motion.q - q) * is_free, _damped_steps(J, twists, DAMPINGS)
    gap = _least_gap(changes, steps * is_free[:, None], (0.0, np.inf))
    gap[is_free.sum(axis=-1) < MIN_FREE] = np.inf
    return np.asarray(gap / np.maximum(np.linalg.norm(changes, axis=-1), 1e-300))


def _damped_steps(J: FloatArray, twists: FloatArray, dampings: FloatArray) -> FloatArray:
    """Return the steps J' (J J' + damping I)^-1 e along twists e, (frame, damping, joint)."""
    values, U = np.linalg.eigh(J @ np.swapaxes(J, 1, 2))
    parts = np.einsum("fij,fi->fj", U, twists)[:, None]
    parts = parts / (np.maximum(values, 0.0)[:, None] + dampings)
    return np.asarray(np.einsum("fij,fik,fdk->fdj", J, U, parts))


def _least_gap(changes: FloatArray, steps: FloatArray, factors: tuple[float, float]) -> FloatArray:
    """Return the least distance of changes from steps times a factor in a range, (frame)."""
    lengths = np.maximum((steps * steps).sum(axis=-1), 1e-300)
    scales = np.clip(np.einsum("fdj,fj->fd", steps, changes) / lengths, *factors)
    gaps = np.linalg.norm(changes[:, None] - scales[..., None] * steps, axis=-1)
    return np.asarray(gaps.min(axis=-1))


def _scaled(
    dampings: FloatArray, factors: tuple[float, float], motion: Trajectory, laws: set[str]
) -> Evidence:
    """Return the frames that are right steps with some of these dampings, times a factor."""
    J, changes = motion.jacobians * ~motion.at_limits[:, None], motion.changes * ~motion.at_limits
    steps = _damped_steps(J, motion.twists(motion.previous), dampings)
    lengths = np.linalg.norm(changes, axis=-1)
    is_single = motion.inputs["max_iterations"] == 1 and changes.shape[1] >= MIN_FREE
    is_close = _least_gap(changes, steps, factors) <= SAME_SCALE * lengths
    return Evidence((lengths > AT_LIMIT) & is_single, is_close)


def _is_stuck(key: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that end off the minimum, and where a fault's step goes nowhere.

    A solver that accepts only steps that reduce the error ends where its own do not.
    """
    e, R = motion.twists(motion.q), RIGHT.frames(motion.inputs, motion.q).rotation
    (J,) = RIGHT.jacobians(motion.inputs, motion.q)
    J = J * ~motion.at_limits[:, None]
    twists = e, TWISTS[key](e, R, motion.targets().rotations)
    right, wrong = (np.einsum("fij,fi->fj", J, twist) for twist in twists)
    scale = np.linalg.norm(right, axis=-1) * np.linalg.norm(wrong, axis=-1)
    cosine = (right * wrong).sum(axis=-1) / np.maximum(scale, 1e-300)
    is_at_start = np.abs(motion.changes).max(axis=-1) <= AT_LIMIT
    concerned = _ends_off_target(motion) & motion.is_pose & ~_is_at_minimum(motion)
    return Evidence(concerned, (np.abs(cosine) <= NOWHERE) | (is_at_start & (cosine < 0.0)))


def _step_gaps(motion: Trajectory) -> dict[str, FloatArray]:
    """Return the gaps to a right step and to steps of faults, by key."""
    J, q, e = motion.jacobians, motion.previous, motion.twists(motion.previous)
    R, goals = RIGHT.frames(motion.inputs, q).rotation, motion.targets().rotations
    twists = {key: rule(e, R, goals) for key, rule in TWISTS.items()}
    if len(q) > 1:
        twists["no feedback"] = motion.displacements
    gaps = {key: _step_gap(motion, J, q, twist) for key, twist in twists.items()}
    if motion.inputs["max_iterations"] == 1:
        for key, fault in STEP_FAULTS.items():
            gaps[key] = np.minimum.reduce(list(_fault_gaps(fault, motion)))
    if len(q) > 1:
        first, start = np.repeat(J[:1], len(q), axis=0), np.tile(q[0], (len(q), 1))
        gaps["frames start anew"] = _step_gap(motion, first, start, motion.twists(start))
    return gaps


def _angles_between(R: FloatArray, goals: FloatArray) -> FloatArray:
    """Return the differences of roll, pitch and yaw from matrices to quaternions, (frame, 3)."""
    pairs = zip(R, rotation.to_matrix(goals), strict=True)
    return np.array([np.subtract(roll_pitch_yaw(b), roll_pitch_yaw(a)) for a, b in pairs])


def _fault_gaps(fault: RobotFault, motion: Trajectory) -> Iterator[FloatArray]:
    """Yield the gaps to steps with a fault's Jacobians, and rotation vectors or sines."""
    q = motion.previous
    errors = [_errors(fault, motion, q)]
    if len(q) == 1:  # the errors of frames are small
        errors.append(_errors(fault, motion, q, sine_error))
    for J in fault.jacobians(motion.inputs, q):
        yield from (_step_gap(motion, J, q, error) for error in errors)


@lru_cache(maxsize=200)
def _nearest_steps(motion: Trajectory) -> tuple[BoolArray, list[str]]:
    """Return the frames that move from off their targets, and the key of each frame's step."""
    is_off = motion.errors(motion.twists(motion.previous)) > LENIENT
    is_moving = np.abs(motion.changes).max(axis=-1) > AT_LIMIT
    gaps = _step_gaps(motion)
    keys, table = list(gaps), np.array(list(gaps.values()))
    is_right = (gaps[""] <= SAME_STEP) & (
        gaps[""] <= np.maximum(EQUAL_STEP, NEARER * table.min(axis=0))
    )
    table[0] = np.where(is_right, 0.0, table[0])
    names = [keys[i] if table[i, f] <= SAME_STEP else "unknown"
             for f, i in enumerate(table.argmin(axis=0))]  # fmt: skip
    return is_off & is_moving & motion.case.facts["reachable"], names


def _is_step(key: str, motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that move, and where the step is nearest to that of a fault."""
    is_telling, keys = _nearest_steps(motion)
    return Evidence(is_telling, np.array([name == key for name in keys]))


def _single_step(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the frames that make a single right step though more are allowed."""
    concerned = _ends_off_target(motion) & motion.is_pose
    return Evidence(concerned, _is_step("", motion, laws).explained)


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
    return Evidence(_nearest_steps(motion)[0], np.array(list(spans)) & ~is_right)


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
    """Return the jumps from near a singularity, or towards a target beyond reach."""
    explained = _is_singular(motion) | ~motion.case.facts["reachable"]
    return _jumping(motion, explained, repeats=MIN_FRAMES)


def _branch(motion: Trajectory, laws: set[str]) -> Evidence:
    """Return the jumps between configurations that are both on their targets."""
    is_on_target = ~motion.is_off_target
    before = np.concatenate([is_on_target[:1], is_on_target[:-1]])
    whole = np.abs(np.abs(motion.changes) - 2.0 * np.pi).min(axis=-1) < WHOLE_TURN
    return _jumping(motion, is_on_target & before & ~whole & ~_is_singular(motion))


def _clamped_start(motion: Trajectory) -> FloatArray:
    return np.clip(motion.inputs["start"], motion.inputs["lower"], motion.inputs["upper"])


# The speeds that faults report, given those that lead to the coordinates.
SPEEDS: Mapping[str, Callable[[FloatArray, Trajectory], FloatArray]] = {
    "velocities zero": lambda v, motion: 0.0 * v,
    "velocities reversed": lambda v, motion: -v,
    "velocities as changes": lambda v, motion: motion.inputs["h"] * v,
    "velocities times the step": lambda v, motion: motion.inputs["h"] ** 2 * v,
    "velocities of the frame before": lambda v, motion: np.concatenate([0.0 * v[:1], v[:-1]]),
    "central differences": lambda v, motion: np.gradient(motion.q, motion.inputs["h"], axis=0),
    "first velocity zero": lambda v, motion: np.concatenate([0.0 * v[:1], v[1:]]),
    "first velocity from the clamped start": lambda v, motion: np.concatenate(
        [(motion.q[:1] - _clamped_start(motion)) / motion.inputs["h"], v[1:]]
    ),
}
# What explains whole poses comes before what explains steps, jumps and misses.
POSES: Mapping[str, Signature] = {
    "angles from zero": _from_zero,
    "limits on one side": _one_sided,
    "limits ignored": _limits_ignored,
    "one frame late": lambda motion, laws: _late(motion, -1),
    "one frame early": lambda motion, laws: _late(motion, 1),
    "long way round": partial(_by_law, "both signs of a quaternion"),
    **{key: partial(_speeds, key) for key in SPEEDS},
    "wrong time step": partial(_by_law, "velocities and coordinates"),
    "clamped after the solve": _clamped,
    "looser tolerance": partial(_with_another_tolerance, lambda b, tol: b <= LOOSER * tol),
    "squared errors": partial(_with_another_tolerance, lambda b, tol: b <= 1.01 * np.sqrt(tol)),
    **{k: partial(_reached, fault) for k, fault in POSE_FAULTS.items() if k != POSITION_ONLY},
}
NOT_STEPS = ("columns negated", "lever arms reversed", POSITION_ONLY)
STEP_FAULTS = {
    key: fault
    for key, fault in (POSE_FAULTS | JACOBIAN_FAULTS).items()
    if not (fault.relative or fault.order or key in NOT_STEPS)
}
# The right twists e of tools with rotation matrices R to goals, and those of faults.
TWISTS: Mapping[str, Callable[[FloatArray, FloatArray, FloatArray], FloatArray]] = {
    "": lambda e, R, goals: e,
    "Jacobian in the tool's frame": lambda e, R, goals: _both(R, e),
    "error in the tool's frame": lambda e, R, goals: _both(np.swapaxes(R, 1, 2), e),
    "rotation error reversed": lambda e, R, goals: e * np.repeat([1.0, -1.0], 3),
    "linear and angular swapped": lambda e, R, goals: np.roll(e, 3, axis=-1),
    "step reversed": lambda e, R, goals: -e,
    "position error reversed": lambda e, R, goals: e * np.repeat([-1.0, 1.0], 3),
    "rotation error in the tool's frame": lambda e, R, goals: np.concatenate(
        [e[:, :3], np.einsum("fji,fj->fi", R, e[:, 3:])], axis=-1
    ),
    "rotation error doubled": lambda e, R, goals: e * np.repeat([1.0, 2.0], 3),
    "difference of Euler angles": lambda e, R, goals: np.concatenate(
        [e[:, :3], _angles_between(R, goals)], axis=-1
    ),
}
STEP_KEYS = (*(key for key in TWISTS if key), "no feedback", "frames start anew", *STEP_FAULTS)
STEPS: Mapping[str, Signature] = {
    "damping too large": partial(_scaled, OVERDAMPED, (0.9, 1.1)),
    "steps too short": partial(_scaled, DAMPINGS[DAMPINGS < 0.1][:, None], SHORT),
    **{key: partial(_is_step, key) for key in STEP_KEYS},
    "transposed Jacobian": _transposed,
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
OTHER_LIMITS: Mapping[str, Signature] = {
    "limits in degrees": partial(
        _within, lambda m: (np.radians(m.inputs["lower"]), np.radians(m.inputs["upper"]))
    ),
    "limits mirrored": partial(_within, lambda m: (-m.inputs["upper"], m.inputs["upper"])),
    "limits of half a turn": partial(_within, lambda m: (0.0 * m.q - np.pi, 0.0 * m.q + np.pi)),
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
# Signatures, whether the family of cases that shows a fault best decides, and the least share.
TIERS: Sequence[tuple[Mapping[str, Signature], bool, float]] = (
    (ORDERS, False, 0.97),
    (OTHER_LIMITS, False, 0.97),
    (POSES, False, MIN_SHARE),
    (STEPS, True, MIN_SHARE),
    (STUCK, True, 0.65),
    ({POSITION_ONLY: partial(_reached, POSE_FAULTS[POSITION_ONLY])}, False, MIN_SHARE),
    (VAGUE, False, MIN_SHARE),
)
FAULTS = tuple(dict.fromkeys(key for signatures, *_ in TIERS for key in signatures))
