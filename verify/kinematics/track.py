"""Following a curve: each frame an honest pose, on its target, near the frame before."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Skeleton
from plumbob.reference.tracking import track
from plumbob.text.sentence import Sentence, sentence, with_code

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..gaps import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..laws import HOLDS, finding, judge_case
from . import claims, pose_laws, problems, rounding, skeletons, sweeps
from .faults import TABLE, SwitchFault
from .inverse_kinematics import METHODS
from .pose_laws import AnsweredPose
from .predictions import forward, predict_track
from .problems import TargetProblem
from .report import diagnosis_of, report, with_hints
from .skeletons import CaseFamily
from .switches import Switches

TASK = "track"
# Another method that is within this share of the reach is slow, not wrong.
SLOW = 1e-2
CONTINUES = "each frame from the one before"
FRAMES, TOLERANCE, SWEEPS = 8, 1e-4, 60
# A joint that moves farther than this between neighbouring frames has jumped: on these curves the
# textbook's CCD and FABRIK, each frame from the one before, move no joint half as far [m].
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
        x = predict_track(method, Switches(), case)["path_positions"]
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


def diagnose(judged: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the motions, likely those of the inverse kinematics."""
    exchanges, greeting, base = judged.exchanges, judged.greeting, judged.base or ()
    judgements, method = judged.report.judgements, judged.report.method
    comparable = {e.case.name: _comparable(e) for e in exchanges if frames_of(e)}
    wrong = [
        comparable[judgement.case.name]
        for judgement in judgements
        if judgement.case.name in comparable and _is_wrong(judgement)
    ]
    diagnosis = _diagnosis(exchanges, comparable, wrong, greeting, method, base)
    answers = [
        claims.values_of(e.case, [frame.pose for frame in frames_of(e)], {}, method, greeting)
        for e in exchanges
        if e.case.name in comparable
    ]
    diagnosis = claims.with_claims(diagnosis, judgements, answers, not base)
    return with_hints(judgements, diagnosis)


def _diagnosis(
    exchanges: Sequence[Exchange],
    comparable: Mapping[str, Exchange],
    wrong: Sequence[Exchange],
    greeting: Greeting,
    method: str,
    base: Sequence[SwitchFault],
) -> Diagnosis:
    """Return the faults that reproduce the motions of a method, or of any of the textbook's."""
    bound = partial(_prediction_bound, greeting)
    diagnoses = [
        diagnosis_of(f"track {textbook}", list(comparable.values()), wrong, bound, base=base)
        for textbook in METHODS
        if method in ("", textbook)
    ]
    shares = [max((e.share for e in d.explanations), default=0.0) for d in diagnoses]
    best = diagnoses[int(np.argmax(shares))] if diagnoses else Diagnosis()
    explanations = tuple(_of_solves(explanation, base) for explanation in best.explanations)
    if wrong and not any(explanation.share == 1.0 for explanation in explanations):
        blended = _blended([frames_of(exchange) for exchange in exchanges])
        explanations = (blended,) if blended else explanations
    return replace(best, explanations=explanations)


def _of_solves(explanation: Explanation, base: Sequence[SwitchFault]) -> Explanation:
    """Return an explanation that says if its faults are also of single solves."""
    keys = {fault.key for fault in base}
    if not keys.issuperset(explanation.faults[0].split(" + ")):
        return explanation
    words = sentence(
        "Its inverse_kinematics has the same mistake: {what}", what=explanation.sentence
    )
    return replace(explanation, sentence=words)


def _blended(answers: Sequence[Sequence[Frame]]) -> Explanation | None:
    """Return that effectors go a part of the way to each target, if they do.

    They set out where they were, or from the target before, and end within the tolerance.
    """
    pairs = [pair for frames in answers for pair in itertools.pairwise(frames)]
    pairs = [pair for pair in pairs if all(frame.case.facts["least"] == 0.0 for frame in pair)]
    for origin, start_of in STARTS:
        ways = np.array([frame.case.inputs["target"] - start_of(last) for last, frame in pairs])
        moves = np.array([_effector(frame) - start_of(last) for last, frame in pairs])
        part = float((ways * moves).sum() / max((ways * ways).sum(), 1e-300)) if pairs else 1.0
        misses = np.linalg.norm(moves - part * ways, axis=-1)
        if LEAST_PART < part < 1.0 - LEAST_PART and misses.max() <= 2.0 * TOLERANCE:
            entry = TABLE["follow"][BLENDED]
            words = sentence(
                "{what} It goes {part:.0%} of the way from {where} to each target.",
                what=Sentence(entry["sentence"], {}), part=part, where=origin,
            )  # fmt: skip
            return Explanation((BLENDED,), with_code(entry["code"], words), 1.0, 0.0)
    return None


def _effector(frame: Frame) -> FloatArray:
    return np.asarray(frame.pose.positions[frame.case.inputs["effector"]])


# Where effectors set out that go a part of the way to targets, by the frame before.
STARTS: Sequence[tuple[Sentence, Callable[[Frame], FloatArray]]] = (
    (sentence("the target before"), lambda last: np.asarray(last.case.inputs["target"])),
    (sentence("where it was"), _effector),
)
BLENDED, LEAST_PART = "targets blended", 0.02


def _is_wrong(judgement: CaseJudgement) -> bool:
    """Return whether frames break a law, or jump."""
    return judgement.verdict >= Verdict.WRONG or any(
        entry.verdict and entry.law in ("continuity", CONTINUES) for entry in judgement.findings
    )


def _prediction_bound(greeting: Greeting, case: Case) -> float:
    """Return the relative difference that rounding, enlarged from frame to frame, explains."""
    return max(1e-8, 16.0 * sweeps.prediction_bound(greeting, case))


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


def _comparable(exchange: Exchange) -> Exchange:
    """Return the exchange with the outputs that variants predict."""
    frames = [frame.pose.outputs for frame in frames_of(exchange)]
    names = [name for name in frames[0] if all(name in frame for frame in frames)]
    answer = Answer({name: np.array([x[name] for x in frames]) for name in names}, 0.0)
    return Exchange(exchange.case, answer, answer)


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
    answer, bound = _comparable(exchange).answer, _prediction_bound(greeting, exchange.case)
    assert isinstance(answer, Answer)
    warm, cold = (
        difference(predict_track(method, Switches(frame_start=start), exchange.case), answer.values)
        for start in (0, 1)
    )
    return finding(CONTINUES, float(warm > bound >= cold))


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
