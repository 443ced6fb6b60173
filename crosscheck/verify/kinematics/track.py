"""Following a curve: each frame an honest pose, on its target, near the frame before."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Skeleton
from plumbob.reference.tracking import track

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import sentence
from . import laws, pose_laws, problems, rounding, skeletons, sweeps
from .faults import Switches
from .inverse_kinematics import KNOWN
from .pose_laws import AnsweredPose
from .predictions import forward, path_to, predict_track
from .problems import Problem
from .report import diagnosed, report
from .skeletons import Family, Make, chains, trees

TASK = "track"
# Another method that is within this share of the reach is slow, not wrong.
SLOW = 1e-2
CONTINUES = "each frame from the one before"
FRAMES, TOLERANCE, SWEEPS = 8, 1e-4, 60
# A joint that moves farther than this between neighbouring frames has jumped: on these curves the
# textbook's CCD and FABRIK, each frame from the one before, move none half as far [m].
JUMP = 1.0
Scene = tuple[Problem, FloatArray]


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return short curves for chains, the lab's arm on its curves, and a tree."""
    return [
        _case(name, family, scene, method)
        for name, family, scene in skeletons.drawn(FAMILIES, seed, 5 if thorough else 1)
        if skeletons.suits(scene[0].posed.parents, greeting)
    ]


def _case(name: str, family: Family, scene: Scene, method: str) -> Case:
    problem, curve = scene
    inputs = problems.request(problem, TOLERANCE, SWEEPS, method)
    frames = [problems.facts({**inputs, "target": target}, problem.posed) for target in curve]
    del inputs["target"]
    facts = {"size": problem.posed.size, "frames": frames, "path": frames[0]["path"]}
    inputs["curve"] = curve
    return Case(name, TASK, inputs, family.name, family.about, facts=facts)


def _is_smooth(scene: Scene) -> bool:
    """Return whether both textbook solvers track a curve without large rotations of joints."""
    problem, curve = scene
    inputs = problems.request(problem, TOLERANCE, problems.EASY, "") | {"curve": curve}
    case = Case("", TASK, inputs, "", laws.HOLDS)
    path = path_to(problem.posed.parents, problem.effector)
    for method in KNOWN:
        x = predict_track(method, Switches(), case)["positions"]
        missed = np.linalg.norm(x[:, problem.effector] - curve, axis=-1).max() > TOLERANCE
        if missed or np.linalg.norm(np.diff(x[:, path], axis=0), axis=-1).max() >= 0.5:
            return False
    return True


def _circle(make: Make, effector: int) -> problems.Draw:
    """Return how to draw a small circle in space about where the effector is."""

    def scene(rng: np.random.Generator) -> Scene:
        posed = make(rng)
        x, _ = forward(posed._asdict())
        t = 2.0 * np.pi * np.arange(FRAMES) / FRAMES
        circle = 0.15 * np.stack([np.cos(t), np.sin(t), 0.5 * np.sin(2.0 * t)], axis=-1)
        curve = x[effector] + rotation.rotate(rotation.random(rng), circle)
        return Problem(posed, effector, x[effector]), curve

    return problems.accepted(scene, _is_smooth)


def _arm(curve: str, step: int) -> problems.Draw:
    """Return how to draw a part of one of the arm's curves."""

    def scene(rng: np.random.Generator) -> Scene:
        points = curves[curve](150)
        first = int(rng.integers(len(points)))
        part = np.roll(points, -first, axis=0)[: step * FRAMES : step]
        return Problem(skeletons.moved_arm(rng), 4, part[0]), part

    return problems.accepted(scene, _is_smooth)


FAMILIES = (
    Family("small circle", sentence("A chain draws a small circle."), _circle(chains(4), 3)),
    Family("arm, circle", sentence("The lab's arm draws a part of its circle."), _arm("circle", 2)),
    Family("arm, square", sentence("The lab's arm draws a part of its square."), _arm("square", 4)),
    Family("tree", sentence("A branch of a tree draws a small circle."), _circle(trees(6), 5)),
    Family("joint in the middle", sentence("A joint with others below it draws a circle."),
           _circle(chains(6), 4)),
)  # fmt: skip


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold each frame against the laws of poses, and frames against one another."""
    judgements = [_judged(one, method.lower(), greeting) for one in asked]
    seen = {one.case.name: _seen(one) for one in asked if frames_of(one)}
    wrong = [
        seen[judgement.case.name]
        for judgement in judgements
        if judgement.case.name in seen and _is_wrong(judgement)
    ]
    diagnosis = _diagnosis(list(seen.values()), wrong, method.lower(), greeting)
    return report(TASK, method, judgements, diagnosis)


def _is_wrong(judgement: CaseJudgement) -> bool:
    """Return whether frames break a law, or jump."""
    laws_of_frames = ("continuity", CONTINUES)
    jumps = any(one.law in laws_of_frames and one.verdict for one in judgement.findings)
    return jumps or judgement.verdict >= Verdict.WRONG


def _diagnosis(
    seen: Sequence[Exchange], wrong: Sequence[Exchange], method: str, greeting: Greeting
) -> Diagnosis:
    alike = partial(_likeness, greeting)
    methods = (method,) if method in KNOWN else KNOWN
    diagnoses = [diagnosed(f"track {known}", seen, wrong, alike) for known in methods]
    return max(diagnoses, key=lambda one: max((e.share for e in one.explanations), default=0.0))


def _likeness(greeting: Greeting, case: Case) -> float:
    """Return the relative difference that still counts as a variant's answer.

    Frames hand on their rounding to the next, each solve enlarging it a few times.
    """
    return max(1e-8, 16.0 * sweeps.likeness(greeting, case))


def frames_of(one: Exchange) -> list[tuple[Case, AnsweredPose]]:
    """Return each frame as a case of inverse kinematics, and its pose; none if there are none."""
    values = one.answer.values if isinstance(one.answer, Answer) else {}
    names, frames = {"local_rotations", "positions"} & values.keys(), []
    for i, facts in enumerate(one.case.facts["frames"] if names else ()):
        inputs = {**one.case.inputs, "target": one.case.inputs["curve"][i]}
        posed = pose_laws.understood({name: values[name][i] for name in names}, inputs, facts)
        frames.append((replace(one.case, inputs=inputs, facts=facts), posed))
    return frames


def _seen(one: Exchange) -> Exchange:
    """Return the answer as variants predict it."""
    parts = [posed.comparable for _, posed in frames_of(one)]
    values = {name: np.array([part[name] for part in parts]) for name in parts[0]}
    answer = Answer(values, 0.0)
    return Exchange(one.case, answer, answer)


def _judged(one: Exchange, method: str, greeting: Greeting) -> CaseJudgement:
    skeleton = Skeleton(one.case.inputs["parents"], one.case.inputs["offsets"])
    reference = partial(
        track, skeleton, one.case.inputs["curve"], method if method in KNOWN else "ccd",
        start=one.case.inputs["local_rotations"],
        **{name: one.case.inputs[name] for name in ("effector", "tolerance", "max_iterations")},
    )  # fmt: skip

    def findings(values: Mapping[str, Any]) -> list[Finding]:
        frames = frames_of(one)
        if not frames:
            return [laws.missing(pose_laws.NEITHER)]
        findings = [*_frame_laws(frames, greeting), *_continuity([posed for _, posed in frames])]
        return [*findings, _goes_on(one, method, greeting)] if method in KNOWN else findings

    return laws.judged(one, greeting, findings, reference)


def _goes_on(one: Exchange, method: str, greeting: Greeting) -> Finding:
    """Return whether each frame starts from the one before, as far as a textbook's solver shows."""
    answer, bound = _seen(one).answer, _likeness(greeting, one.case)
    assert isinstance(answer, Answer)
    warm, cold = (
        difference(predict_track(method, Switches(frame_start=start), one.case), answer.values)
        for start in (0, 1)
    )
    if not warm > bound >= cold:
        return Finding(CONTINUES, Verdict.RIGHT, 0.0, 0.0, "", laws.HOLDS)
    message = sentence(
        "Every frame starts from the first pose, so that joints may jump. Start each frame from "
        "the one before."
    )
    return Finding(CONTINUES, Verdict.RIGHT_BUT, 1.0, 0.0, "", message)


def _frame_laws(frames: Sequence[tuple[Case, AnsweredPose]], greeting: Greeting) -> list[Finding]:
    """Return the worst finding of each law over all frames."""
    worst: dict[str, Finding] = {}
    for i, (case, posed) in enumerate(frames):
        findings = pose_laws.all_of(posed, case, greeting)
        if posed.finite:
            findings.append(_on_target(posed, case, greeting))
        for finding in findings:
            known = worst.get(finding.law)
            if known is None or (finding.verdict, finding.error) > (known.verdict, known.error):
                message = finding.sentence
                if finding.verdict:
                    message = sentence("Frame {frame}: {what}", frame=i, what=finding.sentence)
                worst[finding.law] = replace(finding, sentence=message)
    return list(worst.values())


def _on_target(posed: AnsweredPose, case: Case, greeting: Greeting) -> Finding:
    joints, size, error = len(posed.positions), case.facts["size"], posed.distance
    slack = rounding.positions(greeting.epsilon, joints, size, posed.drift)
    share = rounding.STALL[greeting.precision] if case.inputs["method"] in KNOWN else SLOW
    message = sentence("It is {error:.2g} m off a target that it can reach.")
    verdict = Verdict.RIGHT_BUT if error <= share * case.facts["reach"] else Verdict.WRONG
    bound = case.inputs["tolerance"] + slack
    return laws.bounded("target reached", error, bound, "m", message, verdict=verdict)


def _continuity(poses: Sequence[AnsweredPose]) -> list[Finding]:
    """Return whether no joint jumps from a frame to the next."""
    x = np.array([posed.positions[posed.path] for posed in poses])
    if not np.isfinite(x).all():
        return []
    moves = np.linalg.norm(np.diff(x, axis=0), axis=-1)
    frame, k = np.unravel_index(int(np.argmax(moves)), moves.shape)
    joint, error = int(poses[0].path[k]), float(moves[frame, k])
    message = sentence(
        "Joint {joint} jumps by {error:.2g} m from frame {frame} to the next: start each frame "
        "from the one before.",
        frame=int(frame),
    )
    verdict = Verdict.RIGHT_BUT
    return [laws.bounded("continuity", error, JUMP, "m", message, verdict=verdict, where=joint)]
