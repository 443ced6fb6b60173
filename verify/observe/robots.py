"""What answers about robots show: of poses and motions, of single iterations, of Jacobians."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..exchange import Answer
from ..judgement import CaseJudgement, Verdict
from ..kinematics import robot_jacobian, robot_targets, robot_velocity
from ..kinematics.robot_models import (
    IDENTITY,
    REDUNDANT,
    Inputs,
    ancestors,
    tool_pose,
)
from ..kinematics.robot_motions import TASK as TRACK
from ..kinematics.trajectories import AT_LIMIT, EXACT, LENIENT, Trajectory, trajectories
from .fits import fit, formula, is_sum
from .joints import sound_cases
from .separation import ElementTable, Findings, Statement, separation

TASKS = (robot_targets.TASK, TRACK, robot_jacobian.TASK, robot_velocity.TASK)
# Fewer answers, frames or joints say nothing.
MIN_COUNT = 6
# A solver that stays in a minimum may end there once or twice by chance.
MIN_CLAMPED = 3
# Shares of nearly all answers, and of few answers.
NEARLY_ALL, FEW = 0.9, 0.5
# A part of the tool's displacement is a factor times the error if the remainder is at most this
# share. Dampings of right solvers leave less. Factors this near to 1 are right.
REMAINDER, NEAR_ONE = 0.05, 0.25
# Entries of Jacobians agree to this share: rounding is larger in differences.
SAME_ENTRY = 1e-5


def robot_evidence(task: str, judgements: Sequence[CaseJudgement]) -> Findings:
    """Return what the answers to a task of robots show."""
    answered = [j for j in judgements if isinstance(j.answer, Answer)]
    tables = {"robot_answer": _wrong_robots(answered)}
    if task == robot_jacobian.TASK:
        words = list(_factors_of_jacobians(answered, tables))
    elif task == robot_velocity.TASK:
        words = list(_tool_velocities(answered))
    else:
        motions = list(trajectories(answered).values())
        words = [words for observe in OBSERVATIONS for words in observe(motions)]
        tables |= _joint_tables(motions, sound_cases(judgements))
    # without a place the verdicts say as much
    tables = {name: t for name, t in tables.items() if t.is_right or separation(t) is not None}
    return Findings(tables, [Statement(float(i), w, True) for i, w in enumerate(words)], [])


def _wrong_robots(judgements: Sequence[CaseJudgement]) -> ElementTable:
    """Return which robots have wrong answers, by what some robots have and others lack."""
    table = ElementTable("robot_answer", is_of_cases=True)
    for judgement in judgements:
        is_wrong = float(judgement.verdict >= Verdict.WRONG)
        inputs = judgement.case.inputs
        features = _robot_features(inputs) | {"opposite_quaternion": _has_opposite(inputs)}
        table.add(judgement.case.name, is_wrong, features)
    return table


def _has_opposite(inputs: Inputs) -> bool:
    """Return whether a target's quaternion is opposite to that of the tool or the frame before."""
    if "start" not in inputs:
        return False
    targets = inputs.get("target_rotations", inputs.get("target_rotation")).reshape(-1, 4)
    path = np.concatenate([tool_pose(inputs, inputs["start"]).rotations[None], targets])
    return bool(((path[1:] * path[:-1]).sum(axis=1) < 0.0).any())


def _robot_features(robot: Inputs) -> dict[str, bool]:
    count, axes = len(robot["axes"]), robot["axes"]
    return {
        "slides": robot["slides"].any(),
        "beyond_pi": (robot["lower"] > np.pi).any() or (robot["upper"] < -np.pi).any(),
        "negative_axes": (axes < 0.0).any(),
        "oblique_axes": (np.abs(axes).max(axis=-1) < 1.0).any(),
        "rotated_frames": (robot["orientations"] != IDENTITY).any(),
        "rotated_tool": (robot["tool_rotation"] != IDENTITY).any(),
        "branches": not ancestors(robot).all(),
        "few_joints": count < REDUNDANT - 1,
        "spare_joints": count >= REDUNDANT,
    }


def _joint_features(robot: Inputs) -> dict[str, BoolArray]:
    joints = np.arange(len(robot["axes"]))
    return {
        "root": joints == 0,
        "last_joint": joints == len(joints) - 1,
        "slide": robot["slides"],
    }


def _joint_tables(motions: Sequence[Trajectory], sound: frozenset[str]) -> dict[str, ElementTable]:
    """Return which joints leave which limits, and which never move though they move the tool."""
    limits, moves = ElementTable("robot_limit", sound), ElementTable("robot_movement", sound)
    for motion in motions:
        name, features = motion.case.name, _joint_features(motion.inputs)
        excess = [motion.inputs["lower"] - motion.q, motion.q - motion.inputs["upper"]]
        of_sides = {key: np.tile(column, 2) for key, column in features.items()}
        of_sides["upper"] = np.repeat([False, True], motion.q.shape[1])
        limits.add(name, np.max(excess, axis=1).ravel(), of_sides, AT_LIMIT)
        is_still = (np.abs(motion.changes) <= EXACT).all(axis=0)
        moves_tool = ancestors(motion.inputs) > 0.0
        if not is_still.all():
            moves.add(name, is_still, features, is_counted=moves_tool)
    return {"robot_limit": limits, "robot_movement": moves}


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
    """Yield how often the tool has its position and its rotation, if either is missed."""
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


Reading = Callable[[Inputs, FloatArray], FloatArray]
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


def _clamped(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield how many targets are missed by joints at limits alone, as by clamps after a solve."""
    clamped, missed = (
        sum(int(getattr(motion, name).sum()) for motion in motions if _is_solve(motion))
        for name in ("is_clamped", "is_missed")
    )
    if clamped >= MIN_CLAMPED and clamped >= FEW * missed:
        yield sentence(
            "Of {missed} targets that are missed, {clamped} are missed by joints at their limits "
            "alone: the other joints are where they would be without limits.",
            missed=missed, clamped=clamped,
        )  # fmt: skip


def _reported_velocities(motions: Sequence[Trajectory]) -> Iterator[Sentence]:
    """Yield the fewest terms whose sum is the reported velocities, unless these are right."""
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
    """Yield what single iterations make of errors, of freely moving robots."""
    rows = []
    for motion in motions:
        if motion.inputs["max_iterations"] == 1 and motion.q.shape[1] >= MIN_COUNT:
            is_free = ~motion.at_limits.any(axis=1) & (np.abs(motion.changes).max(axis=1) > EXACT)
            moves = np.einsum("fij,fj->fi", motion.jacobians, motion.changes)
            errors = motion.twists(motion.previous)
            frames = rotation.to_matrix(tool_pose(motion.inputs, motion.previous).rotations)
            rows.append([part[is_free] for part in (moves, errors, frames)])
    if rows:
        moves, errors, frames = map(np.concatenate, zip(*rows, strict=True))
        yield from _factors(moves, errors, frames, _STEP)


def _tool_velocities(judgements: Sequence[CaseJudgement]) -> Iterator[Sentence]:
    """Yield what tools that can move freely make of the velocity asked for."""
    rows = []
    for judgement in judgements:
        assert isinstance(judgement.answer, Answer)
        inputs, speeds = judgement.case.inputs, judgement.answer.values["velocities"]
        J, twist = robot_velocity.right_equation(inputs)
        if np.linalg.matrix_rank(J, robot_velocity.RANK) == 6 and np.isfinite(speeds).all():
            R = rotation.to_matrix(tool_pose(inputs, inputs["q"]).rotations)
            rows.append((J @ speeds, twist, R))
    if rows:
        moves, twists, frames = map(np.array, zip(*rows, strict=True))
        yield from _factors(moves, twists, frames, _VELOCITY)


PARTS = (sentence("linear part"), sentence("angular part"))
# Frames of an error or a velocity: unchanged, along the tool's axes, rotated once too often.
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
    """Yield the factor of each part of the tool's motion to the right motion, and its axes."""
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


def _factors_of_jacobians(
    judgements: Sequence[CaseJudgement], tables: dict[str, ElementTable]
) -> Iterator[Sentence]:
    """Yield the factors by which all answers differ from a convention; add the table of columns.

    The table is by the convention that most columns have.
    """
    smallest = np.inf
    for name in robot_jacobian.CONVENTIONS:
        table, columns = ElementTable("robot_column", sound_cases(judgements)), []
        for judgement in judgements:
            answer, right, features = _columns(judgement, name)
            scale = max(np.abs(right).max(), 1e-300)
            errors, sizes = (np.abs(x).max(axis=-1) / scale for x in (answer - right, right))
            is_any = np.maximum(errors, sizes) > SAME_ENTRY  # zeros are right for many a reason
            table.add(judgement.case.name, errors, features, is_counted=is_any)
            columns.append((answer, right, features["angular"], features["slide"]))
        if table.wrong_count < smallest:
            smallest, tables["robot_column"] = table.wrong_count, table
        answer, right, is_angular, is_slide = map(np.concatenate, zip(*columns, strict=True))
        groups = [~is_angular & ~is_slide, is_angular & ~is_slide, is_slide]
        factors = [float((answer * right)[group].sum() / max((right[group] ** 2).sum(), 1e-300))
                   for group in groups]  # fmt: skip
        scaled = np.select(groups, factors)[:, None] * right
        if (np.abs(answer - scaled) <= SAME_ENTRY * np.abs(right).max()).all():
            yield sentence(
                "Your numbers are the right ones times a factor: {linear:.6g} in the linear parts "
                "of hinges, {angular:.6g} in their angular parts, {slide:.6g} in slides.",
                linear=factors[0], angular=factors[1], slide=factors[2],
            )  # fmt: skip
            return


def _columns(
    judgement: CaseJudgement, name: str
) -> tuple[FloatArray, FloatArray, dict[str, BoolArray]]:
    """Return the answer's and the right parts of columns, (part, 3), and their features."""
    assert isinstance(judgement.answer, Answer)
    inputs = judgement.case.inputs
    shift = 3 if "angular part first" in name else 0
    right = robot_jacobian.right_jacobian(inputs, robot_jacobian.CONVENTIONS[name])
    answer, right = (
        np.roll(J, shift, axis=0).reshape(2, 3, -1).swapaxes(1, 2).reshape(-1, 3)
        for J in (judgement.answer.values["jacobian"], right)
    )
    count = len(inputs["q"])
    of_joints = _joint_features(inputs) | {"effector": np.arange(count) == inputs["effector"]}
    features = {key: np.tile(column, 2) for key, column in of_joints.items()}
    return answer, right, features | {"angular": np.repeat([False, True], count)}


OBSERVATIONS: Sequence[Callable[[Sequence[Trajectory]], Iterator[Sentence]]] = (
    _readings, _reached_parts, _clamped, _single_iterations, _reported_velocities,
)  # fmt: skip
