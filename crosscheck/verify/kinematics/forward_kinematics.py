"""Forward kinematics: where all joints are, and how they are rotated."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, rotation
from plumbob.reference.skeleton import Pose

from ..case import Case
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..sentence import sentence
from . import laws, rounding, skeletons
from .report import diagnosed, report
from .skeletons import Family, Posed, chain, chains, tree, trees

TASK = "forward_kinematics"


def _half_turns(rng: np.random.Generator) -> Posed:
    posed = chain(rng, 4)
    local = rotation.random(rng, 4)
    local[:, 0] = 0.0
    return posed._replace(local_rotations=local / np.linalg.norm(local, axis=-1, keepdims=True))


def _negative(rng: np.random.Generator) -> Posed:
    posed = chain(rng, 4)
    local = posed.local_rotations
    return posed._replace(local_rotations=local * np.where(local[:, :1] > 0.0, -1.0, 1.0))


def _slight(rng: np.random.Generator) -> Posed:
    posed = chain(rng, 5)
    v = 1e-3 * rng.uniform(-1.0, 1.0, (5, 3))
    return posed._replace(local_rotations=rotation.exponential(v))


def _no_length(rng: np.random.Generator) -> Posed:
    posed = chain(rng, 4)
    posed.offsets[2] = 0.0
    return posed


def _branches(rng: np.random.Generator) -> Posed:
    return tree(rng, 5)._replace(parents=np.array([-1, 0, 0, 0, 1]))


FAMILIES = (
    Family("root only", sentence("A single joint, away from the origin and rotated."), chains(1)),
    Family("two joints, a quarter",
           sentence("Two joints along the axes, rotated by quarters: the answer is seen at a "
                    "glance."),
           lambda rng: skeletons.quarter_turns(rng, 2), 3),
    Family("two joints", sentence("Two joints in a moved pose."), chains(2), 2),
    Family("three joints",
           sentence("Three joints in a moved pose: the order of products begins to matter."),
           chains(3), 3),
    Family("quarters", sentence("A chain along the axes, rotated by quarters."),
           lambda rng: skeletons.quarter_turns(rng, 4), 2),
    Family("half turns", sentence("Rotations by half a turn, of which w is 0."), _half_turns),
    Family("negative w",
           sentence("Quaternions with a negative w, which are rotations as good as any."),
           _negative),
    Family("slight", sentence("Rotations by a thousandth of a radian."), _slight),
    Family("no length", sentence("A link of no length."), _no_length),
    Family("arm at rest", sentence("The lab's arm, straight down."), lambda rng: skeletons.arm()),
    Family("arm", sentence("The lab's arm in a moved pose."), skeletons.moved_arm, 2),
    Family("branches", sentence("A root with three children."), _branches, 2),
    Family("chain", sentence("A chain in a moved pose."), chains(6), 2),
    Family("far away", sentence("A chain whose root is a hundred metres away."), chains(6, 100.0)),
    Family("tree", sentence("A tree in a moved pose."), trees(9), 3),
    Family("long chain", sentence("A chain of thirty joints: rounding adds up."), chains(30)),
    Family("large tree", sentence("A tree of thirty joints, as many as a character has."),
           trees(30)),
)  # fmt: skip


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return skeletons in moved poses, the smallest first."""
    return [
        Case(name, TASK, posed._asdict(), family.name, family.about, facts={"size": posed.size})
        for name, family, posed in skeletons.drawn(FAMILIES, seed, 10 if thorough else 1)
        if skeletons.suits(posed.parents, greeting)
    ]


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold positions and rotations separately against the reference; name the faults."""
    judgements = [_judged(one, greeting) for one in asked]
    wrong = [one for one, judgement in zip(asked, judgements, strict=True) if judgement.verdict > 1]
    diagnosis = diagnosed("forward", asked, wrong, partial(_likeness, greeting))
    return report(TASK, method, judgements, diagnosis)


def _likeness(greeting: Greeting, case: Case) -> float:
    """Return the relative difference that still counts as a variant's answer."""
    joints = len(case.inputs["parents"])
    return max(1e-9, 4.0 * rounding.positions(greeting.epsilon, joints, 1.0))


def _judged(one: Exchange, greeting: Greeting) -> CaseJudgement:
    skeleton = Skeleton(one.case.inputs["parents"], one.case.inputs["offsets"])
    reference = partial(forward_kinematics, skeleton, one.case.inputs["local_rotations"])
    expected, size = reference(), one.case.facts["size"]
    digits = (
        list(_digits(one.answer.values, expected, size)) if isinstance(one.answer, Answer) else []
    )
    return laws.judged(
        one, greeting, lambda values: _findings(values, expected, size, greeting), reference,
        expected._asdict(), min(digits, default=None),
    )  # fmt: skip


def _digits(values: Mapping[str, Any], expected: Pose, size: float) -> Iterator[float]:
    """Yield how many digits of each output are correct; any multiple of q is the same rotation."""
    if "positions" in values:
        error = np.linalg.norm(values["positions"] - expected.positions, axis=-1).max()
        yield laws.digits(error, size)
    if "rotations" in values:
        rotations = values["rotations"]
        with np.errstate(all="ignore"):  # infinite components give NaN
            lengths = np.linalg.norm(rotations, axis=-1, keepdims=True)
            unit = rotations / np.where(lengths > 0.0, lengths, 1.0)
        errors = (np.abs(unit - expected.rotations), np.abs(unit + expected.rotations))
        yield laws.digits(np.minimum(*(part.max(-1) for part in errors)).max(), 1.0)


def _findings(
    values: Mapping[str, Any], expected: Pose, size: float, greeting: Greeting
) -> Iterator[Finding]:
    if "positions" in values:
        tolerance = rounding.positions(greeting.epsilon, len(expected.positions), size)
        yield _positions(values["positions"], expected.positions, tolerance)
    if "rotations" in values:
        bound = rounding.rotations(greeting.epsilon, len(expected.rotations))
        yield from _rotations(values["rotations"], expected.rotations, bound)


def _positions(theirs: Any, ours: Any, tolerance: float) -> Finding:
    errors = np.linalg.norm(theirs - ours, axis=-1)
    if not np.isfinite(errors).all():
        return laws.no_numbers("positions", errors, tolerance)
    message = sentence("Joint {joint} is {error:.2g} m off its position.")
    return laws.of_joints("positions", errors, tolerance, "m", message)


def _rotations(theirs: Any, ours: Any, bound: float) -> list[Finding]:
    """Return the findings of global rotations: their norms, and their angles once normalised."""
    lengths = np.linalg.norm(theirs, axis=-1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    if not usable.all():
        bad = int(np.argmin(usable))
        message = sentence("The rotation of joint {joint} is not a number or zero.", joint=bad)
        return [Finding("rotations", Verdict.WRONG, np.inf, bound, "rad", message, bad)]
    angles = laws.angles(theirs / lengths[:, None], ours)
    message = sentence("Joint {joint} is rotated {error:.2g} rad off.")
    return [laws.unit(lengths, bound), laws.of_joints("rotations", angles, bound, "rad", message)]
