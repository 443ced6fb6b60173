"""Forward kinematics: where all joints are, and how they are rotated."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, rotation

from ..case import Case
from ..contestant import Answer, Asked
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
from . import laws, rounding, skeletons
from .report import diagnosed, report
from .skeletons import Posed

TASK = "forward_kinematics"


class Family(NamedTuple):
    """Cases of a kind: what they try, and the skeleton of one, by its random numbers."""

    name: str
    about: Sentence
    make: Callable[[np.random.Generator], Posed]
    copies: int = 1


def _half_turns(rng: np.random.Generator) -> Posed:
    posed = skeletons.chain(rng, 4)
    local = rotation.random(rng, 4)
    local[:, 0] = 0.0
    return posed._replace(local_rotations=local / np.linalg.norm(local, axis=-1, keepdims=True))


def _negative(rng: np.random.Generator) -> Posed:
    posed = skeletons.chain(rng, 4)
    local = posed.local_rotations
    return posed._replace(local_rotations=local * np.where(local[:, :1] > 0.0, -1.0, 1.0))


def _slight(rng: np.random.Generator) -> Posed:
    posed = skeletons.chain(rng, 5)
    v = 1e-3 * rng.uniform(-1.0, 1.0, (5, 3))
    return posed._replace(local_rotations=rotation.exponential(v))


def _no_length(rng: np.random.Generator) -> Posed:
    posed = skeletons.chain(rng, 4)
    posed.offsets[2] = 0.0
    return posed


def _branches(rng: np.random.Generator) -> Posed:
    posed = skeletons.tree(rng, 5)
    return posed._replace(parents=np.array([-1, 0, 0, 0, 1]))


FAMILIES = (
    Family(
        "root only",
        sentence("A single joint, away from the origin and rotated."),
        lambda rng: skeletons.chain(rng, 1),
    ),
    Family(
        "two joints, a quarter",
        sentence("Two joints along the axes, rotated by quarters: the answer is seen at a glance."),
        lambda rng: skeletons.quarter_turns(rng, 2),
        3,
    ),
    Family(
        "two joints",
        sentence("Two joints in a moved pose."),
        lambda rng: skeletons.chain(rng, 2),
        2,
    ),
    Family(
        "three joints",
        sentence("Three joints in a moved pose: the order of products begins to matter."),
        lambda rng: skeletons.chain(rng, 3),
        3,
    ),
    Family(
        "quarters",
        sentence("A chain along the axes, rotated by quarters."),
        lambda rng: skeletons.quarter_turns(rng, 4),
        2,
    ),
    Family("half turns", sentence("Rotations by half a turn, of which w is 0."), _half_turns),
    Family(
        "negative w",
        sentence("Quaternions with a negative w, which are rotations as good as any."),
        _negative,
    ),
    Family("slight", sentence("Rotations by a thousandth of a radian."), _slight),
    Family("no length", sentence("A link of no length."), _no_length),
    Family("arm at rest", sentence("The lab's arm, straight down."), lambda rng: skeletons.arm()),
    Family("arm", sentence("The lab's arm in a moved pose."), skeletons.moved_arm, 2),
    Family("branches", sentence("A root with three children."), _branches, 2),
    Family(
        "chain", sentence("A chain in a moved pose."), lambda rng: skeletons.chain(rng, 6), 2
    ),
    Family(
        "far away",
        sentence("A chain whose root is a hundred metres away."),
        lambda rng: skeletons.chain(rng, 6, 100.0),
    ),
    Family("tree", sentence("A tree in a moved pose."), lambda rng: skeletons.tree(rng, 9), 3),
    Family(
        "long chain",
        sentence("A chain of thirty joints: rounding adds up."),
        lambda rng: skeletons.chain(rng, 30),
    ),
    Family(
        "large tree",
        sentence("A tree of thirty joints, as many as a character has."),
        lambda rng: skeletons.tree(rng, 30),
    ),
)  # fmt: skip


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return skeletons in moved poses, the smallest first."""
    found = []
    for family in FAMILIES:
        for i in range(family.copies * (10 if thorough else 1)):
            name = f"{family.name} {i + 1}"
            posed = family.make(skeletons.generator(seed, name))
            if skeletons.suits(posed, greeting):
                facts = {"size": posed.size}
                found.append(
                    Case(name, TASK, posed._asdict(), family.name, family.about, facts=facts)
                )
    return found


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold positions and rotations separately against the reference; name the faults."""
    judgements = [_judged(one, greeting) for one in asked]
    wrong = [one for one, told in zip(asked, judgements, strict=True) if told.verdict > 1]
    diagnosis = diagnosed("forward", asked, wrong, lambda case: _likeness(case, greeting))
    return report(TASK, method, asked, judgements, diagnosis, greeting)


def _likeness(case: Case, greeting: Greeting) -> float:
    """Return the relative difference that still counts as a variant's answer."""
    joints = len(case.inputs["parents"])
    return max(1e-9, 4.0 * rounding.positions(greeting.epsilon, joints, 1.0))


def _judged(one: Asked, greeting: Greeting) -> CaseJudgement:
    case, answer = one.case, one.answer
    skeleton = Skeleton(case.inputs["parents"], case.inputs["offsets"])
    local_rotations = case.inputs["local_rotations"]
    (x, R), seconds = timed(lambda: forward_kinematics(skeleton, local_rotations))
    expected = {"positions": x, "rotations": R}
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), expected, None, seconds)
    findings = laws.Findings(greeting)
    digits = []
    joints, size = len(x), case.facts["size"]
    if "positions" in answer.values:
        tolerance = rounding.positions(greeting.epsilon, joints, size)
        error, finding = positions(answer.values["positions"], x, tolerance)
        findings.add(finding)
        digits.append(laws.digits(error, size))
    if "rotations" in answer.values:
        digits.append(laws.digits(_quaternion_error(answer.values["rotations"], R), 1.0))
        findings.extend(rotations(answer.values["rotations"], R, greeting))
    findings.extend(laws.repeated(one, size, greeting))
    findings.extend(laws.remarks(answer))
    return CaseJudgement(case, answer, findings.all, expected, min(digits, default=None), seconds)


def _quaternion_error(rotations: Any, expected: Any) -> float:
    """Return the largest difference of a component; any multiple of q is the same rotation."""
    with np.errstate(all="ignore"):  # infinite components give NaN
        lengths = np.linalg.norm(rotations, axis=-1, keepdims=True)
        unit = rotations / np.where(lengths > 0.0, lengths, 1.0)
    differences = (np.abs(unit - expected).max(-1), np.abs(unit + expected).max(-1))
    return float(np.minimum(*differences).max())


def positions(theirs: Any, ours: Any, tolerance: float) -> tuple[float, Finding]:
    """Return the largest error of the positions [m] and the finding."""
    errors = np.linalg.norm(theirs - ours, axis=-1)
    if not np.isfinite(errors).all():
        return np.inf, laws.no_numbers("positions", errors, tolerance)
    worst = int(np.argmax(errors))
    return errors[worst], laws.bounded(
        "positions", errors[worst], tolerance, "m",
        sentence("Joint {joint} is {error:.2g} m off its position.", joint=worst,
                 error=errors[worst]),
        where=_first(errors > tolerance, worst),
    )  # fmt: skip


def _first(off: Any, worst: int) -> int:
    """Return the first joint that is off, where the fault begins, or the worst."""
    return int(np.argmax(off)) if off.any() else worst


def rotations(theirs: Any, ours: Any, greeting: Greeting) -> list[Finding]:
    """Return the findings of global rotations: their norms, and their angles once normalised."""
    bound = rounding.rotations(greeting.epsilon, len(ours))
    lengths = np.linalg.norm(theirs, axis=-1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    if not usable.all():
        bad = int(np.argmin(usable))
        return [
            Finding(
                "rotations", Verdict.WRONG, np.inf, bound, "rad",
                sentence("The rotation of joint {joint} is not a number or zero.", joint=bad), bad,
            )
        ]  # fmt: skip
    angles = laws.angles(theirs / lengths[:, None], ours)
    worst = int(np.argmax(angles))
    told = sentence(
        "Joint {joint} is rotated {error:.2g} rad off.", joint=worst, error=angles[worst]
    )
    where = _first(angles > bound, worst)
    return [
        laws.unit(lengths, bound),
        laws.bounded("rotations", angles[worst], bound, "rad", told, where=where),
    ]
