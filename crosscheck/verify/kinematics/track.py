"""Following a curve: each frame an honest pose, on its target, near the frame before."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from plumbob.reference import curves, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Skeleton
from plumbob.reference.tracking import track

from ..case import Case
from ..contestant import Answer, Asked
from ..explain import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
from . import laws, pose_laws, problems, rounding, skeletons, sweeps
from .faults import Follow, Switches
from .predictions import forward, path_to, predict_track
from .problems import Problem
from .report import diagnosed, report
from .skeletons import Posed

TASK = "track"
KNOWN = ("ccd", "fabrik")
# Another method that is within this share of the reach is slow, not wrong.
SLOW = 1e-2
CONTINUES = "each frame from the one before"
FRAMES, TOLERANCE, SWEEPS = 8, 1e-4, 60
# A joint that moves farther than this between neighbouring frames has jumped: on these curves the
# textbook's CCD and FABRIK, each frame from the one before, move none half as far [m].
JUMP = 1.0


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return short curves for chains, the lab's arm on its curves, and a tree."""
    found = []
    for name, about, make in _SCENES:
        for i in range(5 if thorough else 1):
            called = f"{name} {i + 1}"
            rng = skeletons.generator(seed, called)
            problem, curve = _smooth(make, rng)
            if skeletons.suits(problem.posed, greeting):
                found.append(_case(called, name, about, problem, curve, method))
    return found


def _case(
    called: str, name: str, about: Sentence, problem: Problem, curve: FloatArray, method: str
) -> Case:
    inputs = problems.request(problem, TOLERANCE, SWEEPS, method)
    del inputs["target"]
    inputs["curve"] = curve
    frames = [problems.facts({**inputs, "target": target}, problem.posed) for target in curve]
    facts = {"size": problem.posed.size, "frames": frames, "path": frames[0]["path"]}
    return Case(called, TASK, inputs, name, about, facts=facts)


def _smooth(
    make: Callable[[np.random.Generator], tuple[Problem, FloatArray]], rng: np.random.Generator
) -> tuple[Problem, FloatArray]:
    """Return a problem that both textbook solvers track without large rotations of joints."""
    for _ in range(problems.DRAWS):
        problem, curve = make(rng)
        inputs = problems.request(problem, TOLERANCE, problems.EASY, "") | {"curve": curve}
        case = Case("", TASK, inputs, "", laws.HOLDS)
        path = path_to(problem.posed.parents, problem.effector)
        if all(_is_smooth(method, case, path) for method in KNOWN):
            return problem, curve
    raise AssertionError("no such curve found")


def _is_smooth(method: str, case: Case, path: Any) -> bool:
    found = predict_track(method, Switches(), case)
    x = found["positions"][:, case.inputs["effector"]]
    met = np.linalg.norm(x - case.inputs["curve"], axis=-1).max() <= TOLERANCE
    moves = np.linalg.norm(np.diff(found["positions"][:, path], axis=0), axis=-1).max()
    return bool(met and moves < 0.5)


def _around(problem: Problem, rng: np.random.Generator) -> FloatArray:
    """Return a small circle in space about where the effector is."""
    t = 2.0 * np.pi * np.arange(FRAMES) / FRAMES
    circle = 0.15 * np.stack([np.cos(t), np.sin(t), 0.5 * np.sin(2.0 * t)], axis=-1)
    return problem.target + rotation.rotate(rotation.random(rng), circle)


def _chain(rng: np.random.Generator) -> tuple[Problem, FloatArray]:
    posed = skeletons.chain(rng, 4)
    return _from(posed, 3, rng)


def _middle(rng: np.random.Generator) -> tuple[Problem, FloatArray]:
    return _from(skeletons.chain(rng, 6), 4, rng)


def _tree(rng: np.random.Generator) -> tuple[Problem, FloatArray]:
    posed = skeletons.tree(rng, 6)
    return _from(posed, 5, rng)


def _from(posed: Posed, effector: int, rng: np.random.Generator) -> tuple[Problem, FloatArray]:
    x, _ = forward(posed._asdict())
    problem = Problem(posed, effector, x[effector])
    return problem, _around(problem, rng)


def _arm(curve: str, step: int) -> Callable[[np.random.Generator], tuple[Problem, FloatArray]]:
    def make(rng: np.random.Generator) -> tuple[Problem, FloatArray]:
        points = curves[curve](150)
        first = int(rng.integers(len(points)))
        part = np.roll(points, -first, axis=0)[: step * FRAMES : step]
        return Problem(skeletons.moved_arm(rng), 4, part[0]), part

    return make


_SCENES = (
    ("small circle", sentence("A chain draws a small circle."), _chain),
    ("arm, circle", sentence("The lab's arm draws a part of its circle."), _arm("circle", 2)),
    ("arm, square", sentence("The lab's arm draws a part of its square."), _arm("square", 4)),
    ("tree", sentence("A branch of a tree draws a small circle."), _tree),
    ("joint in the middle", sentence("A joint with others below it draws a circle."), _middle),
)


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold each frame against the laws of poses, and frames against one another."""
    judgements = [_judged(one, method.lower(), greeting) for one in asked]
    seen = [_seen(one) for one in asked if isinstance(one.answer, Answer) and _has_poses(one)]
    wrong = [
        other
        for other in seen
        for told in judgements
        if told.case is other.case and (told.verdict >= Verdict.WRONG or _jumps(told))
    ]
    diagnosis = _diagnosis(seen, wrong, method.lower(), greeting)
    return report(TASK, method, asked, judgements, diagnosis, greeting)


def _diagnosis(
    seen: Sequence[Asked], wrong: Sequence[Asked], method: str, greeting: Greeting
) -> Diagnosis:
    found = [
        diagnosed(
            f"track {one}", seen, wrong, lambda case: _likeness(case, greeting)
        )
        for one in ((method,) if method in KNOWN else KNOWN)
    ]  # fmt: skip
    return max(found, key=lambda one: max((told.share for told in one.explanations), default=0.0))


def _likeness(case: Case, greeting: Greeting) -> float:
    """Return the relative difference that still counts as a variant's answer.

    Frames hand on their rounding to the next, each solve enlarging it a few times.
    """
    return max(1e-8, 16.0 * sweeps.likeness(case, greeting))


def _has_poses(one: Asked) -> bool:
    assert isinstance(one.answer, Answer)
    return bool({"positions", "local_rotations"} & one.answer.values.keys())


def _jumps(told: CaseJudgement) -> bool:
    laws_of_frames = ("continuity", CONTINUES)
    return any(one.law in laws_of_frames and one.verdict for one in told.findings)


def frames_of(one: Asked) -> list[tuple[Case, pose_laws.Posed]]:
    """Return each frame as a case of inverse kinematics, and its pose."""
    assert isinstance(one.answer, Answer)
    case, values, found = one.case, one.answer.values, []
    for i, facts in enumerate(case.facts["frames"]):
        inputs = {**case.inputs, "target": case.inputs["curve"][i]}
        frame = Case(case.name, TASK, inputs, case.family, case.about, facts=facts)
        part = {
            name: values[name][i] for name in ("local_rotations", "positions") if name in values
        }
        found.append((frame, pose_laws.understood(part, inputs, facts)))
    return found


def _seen(one: Asked) -> Asked:
    """Return the answer as variants predict it."""
    assert isinstance(one.answer, Answer)
    parts = [posed.comparable for _, posed in frames_of(one)]
    values = {name: np.array([part[name] for part in parts]) for name in parts[0]}
    seen = replace(one.answer, values=values)
    return Asked(one.case, seen, seen)


def _judged(one: Asked, method: str, greeting: Greeting) -> CaseJudgement:
    case, answer = one.case, one.answer
    skeleton = Skeleton(case.inputs["parents"], case.inputs["offsets"])
    usual = method if method in KNOWN else "ccd"
    _, seconds = timed(lambda: _reference(skeleton, case.inputs, usual))
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), {}, None, seconds)
    findings = laws.Findings(greeting)
    if _has_poses(one):
        poses = frames_of(one)
        findings.extend(_frame_laws(poses, greeting))
        findings.extend(_continuity([posed for _, posed in poses]))
        if method in KNOWN:
            findings.add(_goes_on(one, method, greeting))
    else:
        told = sentence("The answer has neither rotations nor positions.")
        findings.add(Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", told))
    findings.extend(laws.repeated(one, case.facts["size"], greeting))
    findings.extend(laws.remarks(answer))
    return CaseJudgement(case, answer, findings.all, {}, None, seconds)


def _goes_on(one: Asked, method: str, greeting: Greeting) -> Finding:
    """Return whether each frame starts from the one before, as far as a textbook's solver shows."""
    values, bound = _seen(one).answer, _likeness(one.case, greeting)
    assert isinstance(values, Answer)
    anew = Switches(follow=Follow(start=1))
    apart = [
        difference(predict_track(method, switched, one.case), values.values)
        for switched in (Switches(), anew)
    ]
    told = sentence(
        "Every frame starts from the first pose, so that joints may jump. Start each frame from "
        "the one before."
    )
    starts_anew = apart[0] > bound >= apart[1]
    verdict = Verdict.RIGHT_BUT if starts_anew else Verdict.RIGHT
    return Finding(
        CONTINUES, verdict, float(starts_anew), 0.0, "", told if starts_anew else laws.HOLDS
    )


def _reference(skeleton: Skeleton, inputs: Mapping[str, Any], method: str) -> Any:
    return track(
        skeleton,
        inputs["curve"],
        method,
        start=inputs["local_rotations"],
        effector=inputs["effector"],
        tolerance=inputs["tolerance"],
        max_iterations=inputs["max_iterations"],
    )


def _frame_laws(poses: Sequence[tuple[Case, pose_laws.Posed]], greeting: Greeting) -> list[Finding]:
    """Return the worst finding of each law over all frames."""
    worst: dict[str, Finding] = {}
    for i, (case, posed) in enumerate(poses):
        found = pose_laws.all_of(posed, case, greeting)
        if posed.finite:
            found.append(_on_target(posed, case, greeting))
        for finding in found:
            known = worst.get(finding.law)
            if known is None or (finding.verdict, finding.error) > (known.verdict, known.error):
                told = finding.sentence
                if finding.verdict:
                    told = sentence("Frame {frame}: {what}", frame=i, what=finding.sentence)
                worst[finding.law] = replace(finding, sentence=told)
    return list(worst.values())


def _on_target(posed: pose_laws.Posed, case: Case, greeting: Greeting) -> Finding:
    joints, size = len(posed.start), case.facts["size"]
    slack = rounding.positions(greeting.epsilon, joints, size, posed.drift)
    distance = posed.distance(case)
    share = rounding.STALL[greeting.precision] if case.inputs["method"] in KNOWN else SLOW
    stalls = distance <= share * case.facts["reach"]
    told = sentence("It is {error:.2g} m off a target that it can reach.", error=distance)
    verdict = Verdict.RIGHT_BUT if stalls else Verdict.WRONG
    bound = case.inputs["tolerance"] + slack
    return laws.bounded("target reached", distance, bound, "m", told, verdict=verdict)


def _continuity(poses: Sequence[pose_laws.Posed]) -> list[Finding]:
    """Return whether no joint jumps from a frame to the next."""
    x = np.array([posed.positions[posed.path] for posed in poses])
    if not np.isfinite(x).all():
        return []
    moves = np.linalg.norm(np.diff(x, axis=0), axis=-1)
    frame, k = np.unravel_index(int(np.argmax(moves)), moves.shape)
    joint, error = int(poses[0].path[k]), float(moves[frame, k])
    told = sentence(
        "Joint {joint} jumps by {error:.2g} m from frame {frame} to the next: start each frame "
        "from the one before.",
        joint=joint, error=error, frame=int(frame),
    )  # fmt: skip
    return [
        laws.bounded("continuity", error, JUMP, "m", told, verdict=Verdict.RIGHT_BUT, where=joint)
    ]
