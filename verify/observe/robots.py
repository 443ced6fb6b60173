"""What answers about robots show: of poses and motions, of single iterations, of Jacobians."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.text.sentence import Sentence, sentence

from ..exchange import Answer
from ..judgement import CaseJudgement
from ..kinematics import robot_jacobian, robot_targets, robot_velocity
from ..kinematics.robot_models import ancestors, mechanism, tool_pose
from ..kinematics.robot_motions import TASK as TRACK
from ..kinematics.trajectories import AT_LIMIT, EXACT, LENIENT, Trajectory
from .fits import fit, formula, is_sum
from .separation import Findings, Statement

TASKS = (robot_targets.TASK, TRACK, robot_jacobian.TASK, robot_velocity.TASK)
# Fewer answers, frames or joints say nothing.
MIN_COUNT = 6
# Shares of answers that are nearly all, and of those that are few.
NEARLY_ALL, FEW = 0.9, 0.5
# A part of the tool's displacement is a factor times the error if the remainder is this share of
# it: dampings of right solvers leave less. Factors this near to 1 are right.
REMAINDER, NEAR_ONE = 0.05, 0.25
# Entries of Jacobians agree to this share: rounding is larger in differences.
SAME_ENTRY = 1e-5


def robot_evidence(task: str, judgements: Sequence[CaseJudgement]) -> Findings:
    """Return what the answers to a task of robots show."""
    answered = [j for j in judgements if isinstance(j.answer, Answer)]
    if task == robot_jacobian.TASK:
        words = list(_parts_of_jacobians(answered))
    elif task == robot_velocity.TASK:
        words = list(_factors(*_tool_velocities(answered), _VELOCITY))
    else:
        motions = [_motion(j) for j in answered if _is_finite(j)]
        words = [words for observe in OBSERVATIONS for words in observe(motions)]
    return Findings({}, [Statement(float(i), w, True) for i, w in enumerate(words)], [])


def _is_finite(judgement: CaseJudgement) -> bool:
    assert isinstance(judgement.answer, Answer)
    return bool(np.isfinite(judgement.answer.values.get("q", np.nan)).all())


def _motion(judgement: CaseJudgement) -> Trajectory:
    assert isinstance(judgement.answer, Answer)
    values = judgement.answer.values
    q = np.reshape(values["q"], (-1, len(judgement.case.inputs["start"])))
    claim = values.get("converged")
    is_claimed = None if claim is None else bool(claim)
    return Trajectory(judgement.case, q, is_claimed, values.get("velocities"))


def _is_solve(motion: Trajectory) -> bool:
    """Return whether targets can be reached in many iterations, and do not test tolerances."""
    inputs, family = motion.inputs, motion.case.family
    return inputs["max_iterations"] > 1 and family not in (
        *robot_targets.UNREACHED, robot_targets.TOLERANCE,
    )  # fmt: skip


def _parts_reached(motion: Trajectory, q: FloatArray) -> BoolArray:
    """Return whether the tool is at its position and has its rotation, (frame, 2)."""
    lengths = np.linalg.norm(motion.twists(q).reshape(-1, 2, 3), axis=-1)
    bounds = [motion.inputs[name] for name in ("tolerance", "tolerance_rotation")]
    is_reached = lengths <= LENIENT * np.array(bounds)
    return np.asarray(is_reached[motion.case.facts["reachable"]])


def _count_reached(motion: Trajectory, q: FloatArray) -> int:
    return int(np.sum(_parts_reached(motion, q).all(axis=1)))


# ---- poses and motions


def _reached_parts(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield how often the tool has its position and its rotation, if one of both is missed."""
    parts = [_parts_reached(motion, motion.q) for motion in motions if _is_solve(motion)]
    is_reached = np.concatenate([*parts, np.zeros((0, 2), dtype=bool)])
    at_position, in_rotation = np.sum(is_reached, axis=0).tolist()
    high, low = max(at_position, in_rotation), min(at_position, in_rotation)
    count = len(is_reached)
    if count >= MIN_COUNT and high >= NEARLY_ALL * count and low <= FEW * count:
        yield sentence(
            "Of {count} targets in reach the tool comes to the position of {positions} and to the "
            "rotation of {rotations}.",
            count=count, positions=at_position, rotations=in_rotation,
        )  # fmt: skip


Reading = Callable[[Mapping[str, Any], FloatArray], FloatArray]
# How coordinates may be meant.
READINGS: Sequence[tuple[Sentence, Reading]] = (
    (sentence("degrees"), lambda robot, q: np.where(robot["slides"], q, np.radians(q))),
    (sentence("changes from the start"), lambda robot, q: robot["start"] + q),
    (sentence("those of the joints in reverse order"), lambda robot, q: q[..., ::-1]),
    (sentence("angles of the opposite sense"), lambda robot, q: np.where(robot["slides"], q, -q)),
)


def _readings(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield how coordinates are meant if only so the tool is on its targets."""
    solves = [motion for motion in motions if _is_solve(motion)]
    before = [_count_reached(motion, motion.q) for motion in solves]
    count = sum(int(motion.case.facts["reachable"].sum()) for motion in solves)
    for words, read in READINGS:
        after = [_count_reached(motion, read(motion.inputs, motion.q)) for motion in solves]
        hits, others = sum(after), sum(before)
        if count >= MIN_COUNT and hits >= NEARLY_ALL * count and others <= FEW * count:
            yield sentence(
                "Taken as {reading}, your coordinates bring the tool to {hits} of {count} "
                "targets; as they are, to {others}.",
                reading=words, hits=hits, count=count, others=others,
            )  # fmt: skip


SIDES = (
    sentence("{count} answers leave upper limits, and none leaves lower limits."),
    sentence("{count} answers leave lower limits, and none leaves upper limits."),
)  # fmt: skip


def _limits(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield which limits are left, if those of one side, or of one joint, are kept by all."""
    sides = [
        np.array([motion.inputs["lower"] - motion.q, motion.q - motion.inputs["upper"]]) > AT_LIMIT
        for motion in motions
    ]
    counts = [sum(int(side[k].any(axis=-1).sum()) for side in sides) for k in range(2)]
    if max(counts) < MIN_COUNT:
        return
    if not min(counts):
        yield Sentence(SIDES[int(np.argmin(counts))].template, {"count": max(counts)})
    left = [np.flatnonzero((side[0] | side[1]).any(axis=0)) for side in sides]
    for role, words in ((0, sentence("the first joint")), (-1, sentence("the last joint"))):
        joints = [role % motion.q.shape[1] for motion in motions]
        if all(set(js) <= {j} for js, j in zip(left, joints, strict=True)):
            yield sentence("Of all joints only {joint} leaves its limits.", joint=words)


ROLES: Sequence[tuple[Sentence, Callable[[Mapping[str, Any]], BoolArray]]] = (
    (sentence("The first joint"), lambda robot: np.arange(len(robot["axes"])) == 0),
    (sentence("The last joint"),
     lambda robot: np.arange(len(robot["axes"])) == len(robot["axes"]) - 1),
    (sentence("A slide"), lambda robot: robot["slides"]),
)  # fmt: skip


def _still_joints(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield which joints never move though they move the tool, and others do."""
    for words, has_role in ROLES:
        count, is_still = 0, True
        for motion in motions:
            moves = np.asarray((np.abs(motion.changes) > EXACT).any(axis=0))
            joints = has_role(motion.inputs) & (ancestors(motion.inputs) > 0.0)
            if moves[~joints].any() and joints.any():
                count += 1
                is_still &= not moves[joints].any()
        if count >= MIN_COUNT and is_still:
            yield sentence("{joint} never moves in {count} answers, though it moves the tool.",
                           joint=words, count=count)  # fmt: skip


def _claims(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield that success, or failure, is reported of all answers."""
    claimed = [m for m in motions if m.is_claimed is not None and m.case.family not in FEW_STEPS]
    for claim, words in (
        (True, sentence("Success is reported in all {count} answers, of which {others} are off "
                        "their targets.")),
        (False, sentence("Failure is reported in all {count} answers, of which {others} are on "
                         "their targets.")),
    ):  # fmt: skip
        others = [m for m in claimed if bool(m.is_off_target[0]) is claim]
        if others and len(claimed) >= MIN_COUNT and all(m.is_claimed is claim for m in claimed):
            yield Sentence(words.template, {"count": len(claimed), "others": len(others)})


FEW_STEPS = (robot_targets.STEP, robot_targets.LIMIT_STEP, robot_targets.FEW)


def _accepted_starts(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield the largest errors of starts, in tolerances, that are taken for targets."""
    starts = [motion for motion in motions if motion.case.family == robot_targets.TOLERANCE]
    for part, words in enumerate((sentence("position"), sentence("rotation"))):
        ratios = []
        for motion in starts:
            errors = np.linalg.norm(motion.twists(motion.previous)[0].reshape(2, 3), axis=1)
            ratio = errors / [motion.inputs["tolerance"], motion.inputs["tolerance_rotation"]]
            if ratio[part] > ratio[1 - part]:
                is_accepted = np.abs(motion.changes).max() <= EXACT
                ratios.append((float(ratio[part]), bool(is_accepted)))
        accepted = [ratio for ratio, is_accepted in ratios if is_accepted and ratio > 1.0]
        if accepted and max(ratio for ratio, _ in ratios) > 1.0:
            yield sentence(
                "Starts are taken for targets though their {part} is off by up to {ratio:.3g} "
                "tolerances ({hits} of {count}).",
                part=words, ratio=max(accepted), hits=len(accepted), count=len(ratios),
            )  # fmt: skip


def _reported_velocities(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield the fewest terms whose sum is the reported velocities, if it is not the right one."""
    moving = [motion for motion in motions if motion.velocities is not None]
    if not moving:
        return
    columns: dict[str, list[FloatArray]] = {}
    for motion in moving:
        h, d = motion.inputs["h"], motion.changes
        before, after = np.vstack([0.0 * d[:1], d[:-1]]), np.vstack([d[1:], 0.0 * d[:1]])
        terms = {"(q[i] - q[i-1])/h": d / h, "(q[i] - q[i-1])": d, "h (q[i] - q[i-1])": h * d,
                 "(q[i-1] - q[i-2])/h": before / h, "(q[i+1] - q[i])/h": after / h,
                 "(q[i] - start)/h": (motion.q - motion.inputs["start"]) / h}  # fmt: skip
        inner = slice(1, -1)  # the first and the last frame may be special
        for name, column in {**terms, "": motion.velocities}.items():
            columns.setdefault(name, []).append(column[inner].ravel())
    flat = {name: np.concatenate(parts) for name, parts in columns.items()}
    quantity = flat.pop("")
    terms_found = fit(quantity, flat, 2) if np.isfinite(quantity).all() else None
    if terms_found is not None and not is_sum(terms_found, {"(q[i] - q[i-1])/h": 1.0}):
        yield sentence("The velocities of frames i are {formula} in all {count} motions.",
                       formula=formula(terms_found), count=len(moving))  # fmt: skip


# ---- single iterations, and the velocity of the tool


_STEP = sentence("the tool's displacement in a single iteration")
_VELOCITY = sentence("the tool's velocity")


def _single_iterations(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield what single iterations make of errors, of robots that can move freely."""
    steps = [m for m in motions if m.inputs["max_iterations"] == 1 and m.q.shape[1] >= MIN_COUNT]
    moves, errors, frames = list[FloatArray](), list[FloatArray](), list[FloatArray]()
    cosines = list[float]()
    for motion in steps:
        is_free = ~motion.at_limits.any(axis=1) & (np.abs(motion.changes).max(axis=1) > EXACT)
        if is_free.any():
            J = motion.jacobians[is_free]
            moves.append(np.einsum("fij,fj->fi", J, motion.changes[is_free]))
            errors.append(motion.twists(motion.previous)[is_free])
            tool = tool_pose(motion.inputs, motion.previous[is_free])
            frames.append(rotation.to_matrix(tool.rotations))
            gradients = np.einsum("fij,fi->fj", J, errors[-1])
            cosines += _cosines(gradients, motion.changes[is_free])
    if moves:
        parts = np.concatenate(moves), np.concatenate(errors), np.concatenate(frames)
        yield from _factors(*parts, _STEP)
    if len(cosines) >= MIN_COUNT and min(cosines) > 1.0 - SAME_ENTRY:
        yield sentence("Single iterations go along J' e, the gradient, in all {count} cases.",
                       count=len(cosines))  # fmt: skip


def _cosines(first: FloatArray, second: FloatArray) -> list[float]:
    """Return the cosines of the angles between vectors, (row)."""
    lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    return list(((first * second).sum(axis=1) / np.maximum(lengths, 1e-300)).tolist())


def _tool_velocities(
    judgements: Sequence[CaseJudgement],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the velocities of tools that can move freely, those asked for, and rotations."""
    rows = []
    for judgement in judgements:
        assert isinstance(judgement.answer, Answer)
        inputs, speeds = judgement.case.inputs, judgement.answer.values["velocities"]
        J = jacobian(mechanism(inputs), inputs["q"], -1)
        if np.linalg.matrix_rank(J, robot_velocity.RANK) == 6 and np.isfinite(speeds).all():
            twist = np.concatenate([inputs["linear_velocity"], inputs["angular_velocity"]])
            R = rotation.to_matrix(tool_pose(inputs, inputs["q"]).rotations)
            rows.append((J @ speeds, twist, R))
    shapes = ((0, 6), (0, 6), (0, 3, 3))
    columns = zip(*rows, strict=True) if rows else map(np.zeros, shapes)
    moves, twists, frames = map(np.array, columns)
    return moves, twists, frames


PARTS = (sentence("linear part"), sentence("angular part"))
# Where an error or a velocity is seen: as it is, along the tool's axes, rotated once too often.
AXES = ("fi->fi", "fji,fj->fi", "fij,fj->fi")
FACTORS = (
    sentence("The {part} of {what} is {factor:.3g} times the right one in all {count} cases."),
    sentence("The {part} of {what} is {factor:.3g} times the right one as seen along the tool's "
             "axes, in all {count} cases."),
    sentence("The {part} of {what} is {factor:.3g} times the right one rotated by the tool's "
             "rotation, in all {count} cases."),
)  # fmt: skip


def _factors(
    moves: FloatArray, twists: FloatArray, frames: FloatArray, what: Sentence
) -> Iterator[Sentence]:
    """Yield which factor of the right one each part of the tool's motion is, in whose axes."""
    for part, words in enumerate(PARTS if len(moves) >= MIN_COUNT else ()):
        columns = slice(3 * part, 3 * part + 3)
        move, twist = moves[:, columns], twists[:, columns]
        for number, subscripts in enumerate(AXES):
            arrays = (frames, twist) if number else (twist,)
            seen = np.einsum(subscripts, *arrays)
            factor = float((seen * move).sum() / max((seen * seen).sum(), 1e-300))
            factor = factor if abs(factor) > SAME_ENTRY else 0.0
            gap = np.linalg.norm(move - factor * seen)
            is_right = number == 0 and abs(factor - 1.0) <= NEAR_ONE
            if gap <= REMAINDER * max(np.linalg.norm(move), REMAINDER * np.linalg.norm(seen)):
                if not is_right:
                    values = {"part": words, "what": what, "factor": factor, "count": len(move)}
                    yield Sentence(FACTORS[number].template, values)
                break


# ---- Jacobians


# Groups of entries, by whether a part is angular, of a slide, of the joint that carries the tool
# and of one at the base.
GROUPS: Sequence[tuple[Sentence, Callable[..., BoolArray]]] = (
    (sentence("the linear parts of hinges"), lambda part, slide, last, first: ~part & ~slide),
    (sentence("the angular parts of hinges"), lambda part, slide, last, first: part & ~slide),
    (sentence("the columns of slides"), lambda part, slide, last, first: slide),
    (sentence("the last columns"), lambda part, slide, last, first: last),
    (sentence("the first columns"), lambda part, slide, last, first: first),
    (sentence("the columns of hinges"), lambda part, slide, last, first: ~slide),
)  # fmt: skip


def _parts_of_jacobians(judgements: Sequence[CaseJudgement]) -> Iterator[Sentence]:
    """Yield the factors, or else the only parts, by which all answers differ from a convention."""
    best, share = list[Sentence](), 0.0
    for name, convention in robot_jacobian.CONVENTIONS.items():
        columns = [_columns(judgement, name, convention) for judgement in judgements]
        answer, right, *flags = (np.concatenate(x) for x in zip(*columns, strict=True))
        bound = SAME_ENTRY * np.abs(right).max()
        is_right = np.abs(answer - right).max(axis=-1) <= bound
        groups = [(words, has_parts(*np.array(flags, dtype=bool))) for words, has_parts in GROUPS]
        factors = [float((answer * right)[group].sum() / max((right[group] ** 2).sum(), 1e-300))
                   for _, group in groups[:3]]  # fmt: skip
        scale = np.sum([f * group for f, (_, group) in zip(factors, groups, strict=False)], axis=0)
        if (np.abs(answer - scale[:, None] * right).max(axis=-1) <= bound).all():
            yield sentence(
                "Your numbers are the right ones times a factor: {linear:.6g} in the linear parts "
                "of hinges, {angular:.6g} in their angular parts, {slide:.6g} in slides.",
                linear=factors[0], angular=factors[1], slide=factors[2],
            )  # fmt: skip
            return
        only = [words for words, group in groups if is_right[~group].all()]
        if only and is_right.mean() > share:
            words = sentence("Only {what} of your Jacobians are wrong: all else is right.",
                             what=only[0])  # fmt: skip
            best, share = [words], float(is_right.mean())
    yield from best


def _columns(
    judgement: CaseJudgement, name: str, convention: robot_jacobian.Convention
) -> Sequence[FloatArray]:
    """Return the answer's and the right parts of columns, (part, 3), and flags of each."""
    assert isinstance(judgement.answer, Answer)
    inputs = judgement.case.inputs
    shift = 3 if "angular part first" in name else 0
    answer = judgement.answer.values["jacobian"]
    pair = answer, robot_jacobian.right_jacobian(inputs, convention)
    parts = [np.roll(J, shift, axis=0).reshape(2, 3, -1).swapaxes(1, 2) for J in pair]
    joints = np.arange(len(inputs["q"]))
    flags = (inputs["slides"], joints == inputs["effector"], inputs["parents"] < 0)
    return (
        *(part.reshape(-1, 3) for part in parts),
        np.repeat([0, 1], len(joints)),
        *(np.tile(x, 2) for x in flags),
    )


OBSERVATIONS: Sequence[Callable[[Sequence[Trajectory]], Iterator[Sentence]]] = (
    _readings, _reached_parts, _limits, _still_joints, _single_iterations, _reported_velocities,
    _claims, _accepted_starts,
)  # fmt: skip
