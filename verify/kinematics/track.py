"""Following a curve: each frame an honest pose, on its target, near the frame before."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Skeleton
from plumbob.reference.tracking import track
from plumbob.text.sentence import sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..gaps import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..laws import HOLDS, finding, judge_case
from . import pose_laws, problems, rounding, skeletons, sweeps
from .honest import STARTS_ANEW
from .inverse_kinematics import METHODS
from .pose_laws import AnsweredPose
from .predictions import forward, predict_track
from .problems import TargetProblem
from .report import report
from .skeletons import CaseFamily

TASK = "track"
# Another method that is within this share of the reach is slow, not wrong.
SLOW = 1e-2
CONTINUES = "each frame from the one before"
FRAMES, TOLERANCE, SWEEPS = 8, 1e-4, 60
# A joint has jumped by a larger distance than this between neighbouring frames [m]. On these curves
# the textbook's CCD and FABRIK, each frame from the frame before, move no joint half as far.
JUMP = 1.0


class CurveProblem(NamedTuple):
    """A skeleton, the joint that follows a curve, and the curve (frame, 3) [m]."""

    start: TargetProblem
    curve: FloatArray


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return short curves for chains, the lab's arm on its curves, and a tree."""
    return [
        _case(name, family, problem, greeting, method)
        for name, family, problem in skeletons.drawn(
            TASK, _draw, seed, 5 if thorough else 1, greeting.planar
        )
        if skeletons.suits(problem.start.skeleton.parents, greeting, problem.start.effector)
    ]


def _case(
    name: str, family: CaseFamily, problem: CurveProblem, greeting: Greeting, method: str
) -> Case:
    start = problem.start
    if not greeting.rotations:
        start = start._replace(skeleton=skeletons.without_rotations(start.skeleton))
    inputs = problems.request(start, TOLERANCE, SWEEPS, method) | problems.constants(greeting)
    frames = [problems.facts({**inputs, "target": target}) for target in problem.curve]
    del inputs["target"]
    inputs["curve"] = problem.curve
    facts = {"size": frames[0]["size"], "frames": frames, "path": frames[0]["path"]}
    return Case(name, TASK, inputs, family.name, family.about, facts=facts)


def _is_smooth(problem: CurveProblem) -> bool:
    """Return whether both textbook solvers track a curve without large rotations of joints."""
    start, curve = problem
    inputs = problems.request(start, TOLERANCE, problems.EASY, "") | {"curve": curve}
    case = Case("", TASK, inputs, "", HOLDS)
    for method in METHODS:
        x = predict_track(method, case)["path_positions"]
        is_far = np.linalg.norm(x[:, -1] - curve, axis=-1).max() > TOLERANCE
        if is_far or np.linalg.norm(np.diff(x, axis=0), axis=-1).max() >= 0.5:
            return False
    return True


def _draw(family: CaseFamily, rng: np.random.Generator) -> CurveProblem:
    """Draw problems of a family until one is smooth."""
    drawn = (_candidate(family, rng) for _ in range(problems.DRAWS))
    return next(filter(_is_smooth, drawn))


def _candidate(family: CaseFamily, rng: np.random.Generator) -> CurveProblem:
    """Return a small circle in space about the effector, or a part of one of the arm's curves."""
    kind, *arguments = family.target
    if kind == "small circle":
        (effector,) = arguments
        skeleton = family.pose(rng)
        x, _ = forward(skeleton._asdict())
        t = 2.0 * np.pi * np.arange(FRAMES) / FRAMES
        circle = 0.15 * np.stack([np.cos(t), np.sin(t), 0.5 * np.sin(2.0 * t)], axis=-1)
        curve = x[effector] + (
            circle * skeletons.IN_PLANE
            if family.planar
            else rotation.rotate(rotation.random(rng), circle)
        )
        return CurveProblem(TargetProblem(skeleton, effector, x[effector]), curve)
    name, step = arguments
    points = curves[name](150)[:, [0, 2, 1] if family.planar else [0, 1, 2]]
    first = int(rng.integers(len(points)))
    part = np.roll(points, -first, axis=0)[: step * FRAMES : step]
    return CurveProblem(TargetProblem(family.pose(rng), 4, part[0]), part)


class Frame(NamedTuple):
    """A frame as a case of inverse kinematics, and its pose."""

    case: Case
    pose: AnsweredPose


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge each frame by the laws of poses, and compare it with its neighbours."""
    judgements = [_judge(exchange, method.lower(), greeting) for exchange in exchanges]
    return report(TASK, method.lower(), judgements)


def frames_of(exchange: Exchange) -> list[Frame]:
    """Return the frames of an answer; an empty list if it has no poses."""
    case, answer = exchange.case, exchange.answer
    outputs = answer.values if isinstance(answer, Answer) else {}
    names, frames = {"local_rotations", "positions"} & outputs.keys(), []
    for i, facts in enumerate(case.facts["frames"] if names else ()):
        inputs = {**case.inputs, "target": case.inputs["curve"][i]}
        pose = pose_laws.read_pose({name: outputs[name][i] for name in names}, inputs, facts)
        frames.append(Frame(replace(case, inputs=inputs, facts=facts), pose))
    return frames


def _judge(exchange: Exchange, method: str, greeting: Greeting) -> CaseJudgement:
    inputs = exchange.case.inputs
    reference = partial(
        track, Skeleton(inputs["parents"], inputs["offsets"]), inputs["curve"],
        method if method in METHODS else "ccd", start=inputs["local_rotations"],
        **{name: inputs[name] for name in ("effector", "tolerance", "max_iterations")},
    )  # fmt: skip

    def findings(outputs: Mapping[str, Any]) -> list[Finding]:
        frames = frames_of(exchange)
        if not frames:
            return [finding("numbers, no pose")]
        findings = [*_frame_laws(frames, greeting), *_continuity([frame.pose for frame in frames])]
        return (
            [*findings, _continues(exchange, method, greeting)] if method in METHODS else findings
        )

    allowed = rounding.repeats(greeting.epsilon, exchange.case.facts["size"])
    return judge_case(exchange, findings, allowed, reference)


def _continues(exchange: Exchange, method: str, greeting: Greeting) -> Finding:
    """Return whether frames start from the frame before, as far as a textbook's solver shows."""
    answer, bound = as_poses(exchange).answer, prediction_bound(greeting, exchange.case)
    assert isinstance(answer, Answer)
    warm, cold = (
        difference(predict_track(method, exchange.case, starts_anew), answer.values)
        for starts_anew in (False, True)
    )
    return finding(CONTINUES, float(warm > bound >= cold), choice=STARTS_ANEW)


def _frame_laws(frames: Sequence[Frame], greeting: Greeting) -> list[Finding]:
    """Return the worst finding of each law over all frames."""
    worst: dict[str, Finding] = {}
    for i, (case, pose) in enumerate(frames):
        findings = pose_laws.all_of(pose, case, greeting)
        if pose.finite:
            findings.append(_on_target(pose, case, greeting))
        for entry in findings:
            previous = worst.get(entry.law)
            rank = entry.verdict, entry.error
            if previous is None or rank > (previous.verdict, previous.error):
                words = sentence("Frame {frame}: {what}", frame=i, what=entry.sentence)
                worst[entry.law] = replace(entry, sentence=words) if entry.verdict else entry
    return list(worst.values())


def _on_target(pose: AnsweredPose, case: Case, greeting: Greeting) -> Finding:
    joints, size, error = len(pose.positions), case.facts["size"], pose.distance
    slack = rounding.positions(greeting.epsilon, joints, size, pose.drift)
    share = rounding.STALL[greeting.precision] if case.inputs["method"] in METHODS else SLOW
    verdict = Verdict.RIGHT_EXCEPT if error <= share * case.facts["reach"] else None
    return finding("target reached", error, case.inputs["tolerance"] + slack, verdict=verdict)


def _continuity(poses: Sequence[AnsweredPose]) -> list[Finding]:
    """Return whether no joint jumps from a frame to the next."""
    x = np.array([pose.positions[pose.path] for pose in poses])
    if not np.isfinite(x).all():
        return []
    distances = np.linalg.norm(np.diff(x, axis=0), axis=-1)
    frame, k = np.unravel_index(int(np.argmax(distances)), distances.shape)
    error, joint = distances[frame, k], int(poses[0].path[k])
    return [finding("continuity", error, JUMP, index=joint, frame=int(frame))]


def prediction_bound(greeting: Greeting, case: Case) -> float:
    """Return the relative difference that rounding, enlarged from frame to frame, explains."""
    return max(1e-8, 16.0 * sweeps.prediction_bound(greeting, case))


def as_poses(exchange: Exchange) -> Exchange:
    """Return the exchange with the outputs that variants predict."""
    frames = [frame.pose.outputs for frame in frames_of(exchange)]
    names = [name for name in frames[0] if all(name in frame for frame in frames)]
    answer = Answer({name: np.array([x[name] for x in frames]) for name in names}, 0.0)
    return Exchange(exchange.case, answer, answer)
