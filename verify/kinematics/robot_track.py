"""Robots that follow targets: limits, jumps, rest, laps, and tools on their targets."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import sentence

from ..exchange import Exchange
from ..greeting import Greeting
from ..judgement import Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from . import robot_motions, rounding
from .report import report
from .robot_targets import TOLERANCE
from .trajectories import LENIENT, Trajectory, limit_laws, trajectories

TASK = robot_motions.TASK
cases = robot_motions.cases
# A tool may trail its target by so many of the target's displacements in a frame. Controllers do so
# if each frame removes a sixth of the error.
TRAIL = 5.0
# Errors and movements of joints die out if less than this share remains in the second half of rest.
DECAY = 0.8
# Errors of so many tolerances come from another test, or measure, rather than from moving targets.
FEW_TOLERANCES = 10.0
# At rest a tool may be off by this share of the target's largest displacement in a frame, as beside
# a posture task.
REMAINDER = 0.3
# Joints rest if they move less in a frame [rad or m].
AT_REST = 1e-4
# Joint angles that differ by less after a lap have not drifted [rad].
NO_DRIFT = 1e-2
# Answers to equal targets whose quaternions have another sign may differ so much [rad].
SAME = 1e-2
# The joints of a start beyond its limits are to be within after so many frames.
RETURN = 10
# Parts of a pose on another frame's target, and their components of twists.
PARTS = (
    (sentence("the tool is on"), np.ones(6)),
    (sentence("the position of the tool is that of"), np.repeat([1.0, 0.0], 3)),
    (sentence("the rotation of the tool is that of"), np.repeat([0.0, 1.0], 3)),
)


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge motions by the laws of tracking."""
    motions = trajectories(exchanges)
    judgements = [
        judge_case(
            exchange, partial(_findings, exchange.case.name, motions, greeting),
            rounding.repeats(greeting.epsilon, exchange.case.facts["size"]),
            robot_motions.timed_track(exchange.case.inputs),
        )
        for exchange in exchanges
    ]  # fmt: skip
    return report(TASK, method, judgements)


def _findings(
    name: str, motions: Mapping[str, Trajectory], greeting: Greeting, outputs: Mapping[str, Any]
) -> list[Finding]:
    if name not in motions:
        q = outputs.get("q")
        key = "numbers, no coordinates"
        return [finding(key) if q is None else not_finite("numbers, of a joint", q.sum(axis=0))]
    motion = motions[name]
    return [
        _limits(motion, greeting),
        _on_target(motion, motions, greeting),
        *_beyond_reach(motion),
        *_shifted(motion),
        _jumps(motion),
        *_rest(motion),
        *_laps(motion),
        *_signs(motion, motions),
        *_velocities(motion),
        *limit_laws(motion, motions.values()),
    ]


def _at(frame: int, law: Finding) -> Finding:
    """Return a finding whose sentence names the frame."""
    words = sentence("Frame {frame}: {what}", frame=frame, what=law.sentence)
    return replace(law, sentence=words) if law.verdict else law


def _limits(motion: Trajectory, greeting: Greeting) -> Finding:
    """Return the worst joint beyond its limits; a start beyond them may take frames to return."""
    inputs, worst = motion.inputs, motion.excess.max(axis=-1)
    largest = float(np.abs([inputs["lower"], inputs["upper"]]).max())
    bound = rounding.ROUNDINGS_A_JOINT * greeting.epsilon * largest
    is_beyond = (
        np.clip(inputs["start"], inputs["lower"], inputs["upper"]) != inputs["start"]
    ).any()
    if is_beyond and worst[0] > bound >= worst[RETURN:].max() and (np.diff(worst) <= 0.0).all():
        return finding("limits kept, returning", float((worst > bound).sum()))
    frame = int(np.argmax(worst))
    joint = int(np.argmax(motion.excess[frame]))
    value = float(motion.q[frame, joint])
    return _at(frame, finding("limits kept", worst[frame], bound, index=joint, value=value))


def _on_target(
    motion: Trajectory, motions: Mapping[str, Trajectory], greeting: Greeting
) -> Finding:
    """Return the largest error at targets in reach; a tool may trail targets, but not at rest."""
    facts, twists = motion.case.facts, motion.twists(motion.q)
    slack = rounding.positions(greeting.epsilon, len(motion.previous[0]), facts["size"])
    errors = np.where(facts["reachable"], motion.errors(twists), 0.0)
    bound = 1.0 + slack / motion.inputs["tolerance"]
    trail = TRAIL * np.maximum.accumulate(motion.errors(motion.displacements))
    is_behind = (errors <= np.maximum(trail, bound)).all()
    is_behind &= _dies_out(errors, facts, max(bound, REMAINDER * trail.max() / TRAIL))
    frame = int(np.argmax(errors))
    distance, angle = np.linalg.norm(twists[frame].reshape(2, 3), axis=-1).tolist()
    key = "target followed, behind" if is_behind else "target followed"
    twin = motions.get(motion.case.name.replace(robot_motions.CURVE, robot_motions.STEPS))
    if is_behind and twin is not None and twin is not motion:
        key += ", one iteration" * np.array_equal(motion.q, twin.q)
    if is_behind and errors[frame] <= FEW_TOLERANCES:
        key = "target followed, within a few tolerances"
    key = key if frame < facts["certain"] else "target followed, another"
    if motion.case.family == TOLERANCE and motion.changes.any():
        key = "target followed, behind"  # it does not take the start for near enough
    # Greatest speeds leave no other choice than to come later.
    verdict = Verdict.RIGHT if is_behind and "velocity_limits" in motion.inputs else None
    law = finding(key, errors[frame], bound, verdict=verdict, distance=distance, angle=angle)
    return _at(frame, law)


def _dies_out(values: np.ndarray, facts: Mapping[str, Any], bound: float) -> bool:
    """Return whether values of frames vanish or decrease while the target rests."""
    half = facts["rest"] // 2
    if not half:
        return True
    first, second = values[-2 * half : -half].max(), values[-half:].max()
    return bool(second <= max(bound, DECAY * first))


def _beyond_reach(motion: Trajectory) -> Iterator[Finding]:
    """Yield how much farther than necessary from targets beyond reach tools are.

    No tool is nearer than the straight arm; solvers that weigh its rotation may be farther by the
    links behind the wrist.
    """
    inputs, is_beyond = motion.inputs, ~motion.case.facts["reachable"]
    if motion.case.family != robot_motions.BOUNDARY:
        return
    shoulder, wrist = (
        inputs["origins"][:2].sum(axis=0),
        np.linalg.norm(inputs["origins"][-3:], axis=1),
    )
    reach = motion.case.facts["size"] - np.linalg.norm(shoulder)
    least = np.linalg.norm(inputs["target_positions"] - shoulder, axis=-1) - reach
    distances = np.linalg.norm(motion.twists(motion.q)[:, :3], axis=-1)
    excess = np.where(is_beyond, distances - np.maximum(least, 0.0), 0.0)
    frame = int(np.argmax(excess))
    allowance = float(wrist.sum() + np.linalg.norm(inputs["tool_position"]))
    yield _at(frame, finding("nearest point", excess[frame], allowance))


def _shifted(motion: Trajectory) -> Iterator[Finding]:
    """Yield whether tools are on the targets of the frames before or after, or a part of them."""
    for key, shift in (("frames in step, late", -1), ("frames in step, early", 1)):
        shares = [_share_on_target(motion, shift, parts) for _, parts in PARTS]
        largest = int(np.argmax(shares))
        yield finding(key, shares[largest], 0.5, what=PARTS[largest][0])


def _share_on_target(motion: Trajectory, shift: int, parts: FloatArray) -> float:
    """Return the share of moving frames in which parts of a tool are on another frame's target."""
    moved, missed, shifted = (
        motion.errors(twists * parts)[1:]
        for twists in (motion.displacements, motion.twists(motion.q),
                       motion.twists(motion.q, shift))
    )  # fmt: skip
    is_moving, matches = moved > LENIENT, (shifted <= LENIENT) & (missed > LENIENT)
    return float(matches[is_moving].mean()) if is_moving.sum() > LENIENT else 0.0


def _jumps(motion: Trajectory) -> Finding:
    certain = motion.jumps[: motion.case.facts["certain"]]
    frame = int(np.argmax(certain if certain.max() > 1.0 else motion.jumps))
    changes, smallest = np.abs(motion.changes[frame]), float(motion.least_changes[frame])
    joint = int(np.argmax(changes))
    key = "no jumps" if frame < motion.case.facts["certain"] else "no jumps, coming back"
    return _at(frame, finding(key, motion.jumps[frame], 1.0, index=joint, least=smallest,
                              change=float(changes[joint])))  # fmt: skip


def _rest(motion: Trajectory) -> Iterator[Finding]:
    """Yield whether the arm rests with its target; its movement may die out."""
    facts, changes = motion.case.facts, np.abs(motion.changes)
    if facts["rest"]:
        is_quiet = _dies_out(changes.max(axis=-1), facts, AT_REST)
        last = changes[-(facts["rest"] // 2) :].max(axis=0)
        is_quiet |= facts["certain"] < len(changes)
        key = "rest, dying out" if is_quiet else "rest"
        yield finding(key, last.max(), AT_REST, index=int(np.argmax(last)))


def _laps(motion: Trajectory) -> Iterator[Finding]:
    """Yield how far joints are from where they were a lap before."""
    laps = motion.case.facts["laps"]
    if laps > 1:
        ends = motion.q.reshape(laps, -1, motion.q.shape[-1])[:, -1]
        drift = np.abs(np.diff(ends, axis=0)).max(axis=0)
        joint = int(np.argmax(drift))
        yield finding("no drift over laps", drift[joint], NO_DRIFT, index=joint)


def _signs(motion: Trajectory, motions: Mapping[str, Trajectory]) -> Iterator[Finding]:
    """Yield whether quaternions of either sign get the same answer."""
    twin = motions.get(motion.case.name.replace(robot_motions.FLIPPED, robot_motions.CURVE))
    if motion.case.family == robot_motions.FLIPPED and twin is not None:
        differences = np.abs(motion.q - twin.q).max(axis=-1)
        frame = int(np.argmax(differences))
        yield _at(frame, finding("both signs of a quaternion", differences[frame], SAME))


def _velocities(motion: Trajectory) -> Iterator[Finding]:
    """Yield whether joints keep their greatest speeds, and whether reported speeds are theirs."""
    h, changes, velocities = motion.inputs["h"], motion.changes, motion.velocities
    if "velocity_limits" in motion.inputs:
        speeds = np.abs(changes) / h
        ratios = speeds / motion.inputs["velocity_limits"]
        frame, joint = divmod(int(np.argmax(ratios)), ratios.shape[1])
        yield _at(frame, finding("velocity limits kept", ratios.max(), 1.0 + 1e-6, index=joint,
                                 speed=float(speeds[frame, joint])))  # fmt: skip
    if velocities is not None:
        yield finding("velocities and coordinates", np.abs(changes - h * velocities).max(), AT_REST)
