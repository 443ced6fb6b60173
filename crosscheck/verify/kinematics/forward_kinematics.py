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
from .report import diagnosis_of, report
from .skeletons import CaseFamily, PosedSkeleton, chain, chains, tree, trees

TASK = "forward_kinematics"


def _half_turns(rng: np.random.Generator) -> PosedSkeleton:
    skeleton = chain(rng, 4)
    local = rotation.random(rng, 4)
    local[:, 0] = 0.0
    return skeleton._replace(local_rotations=local / np.linalg.norm(local, axis=-1, keepdims=True))


def _negative(rng: np.random.Generator) -> PosedSkeleton:
    skeleton = chain(rng, 4)
    local = skeleton.local_rotations
    return skeleton._replace(local_rotations=local * np.where(local[:, :1] > 0.0, -1.0, 1.0))


def _slight(rng: np.random.Generator) -> PosedSkeleton:
    skeleton = chain(rng, 5)
    v = 1e-3 * rng.uniform(-1.0, 1.0, (5, 3))
    return skeleton._replace(local_rotations=rotation.exponential(v))


def _no_length(rng: np.random.Generator) -> PosedSkeleton:
    skeleton = chain(rng, 4)
    skeleton.offsets[2] = 0.0
    return skeleton


def _branches(rng: np.random.Generator) -> PosedSkeleton:
    return tree(rng, 5)._replace(parents=np.array([-1, 0, 0, 0, 1]))


FAMILIES = (
    CaseFamily("root only", sentence("A single joint, away from the origin and rotated."),
               chains(1)),
    CaseFamily("two joints, a quarter",
               sentence("Two joints along the axes, rotated by quarters: the answer is seen at a "
                        "glance."),
               lambda rng: skeletons.quarter_turns(rng, 2), 3),
    CaseFamily("two joints", sentence("Two joints in a moved pose."), chains(2), 2),
    CaseFamily("three joints",
               sentence("Three joints in a moved pose: the order of products begins to matter."),
               chains(3), 3),
    CaseFamily("quarters", sentence("A chain along the axes, rotated by quarters."),
               lambda rng: skeletons.quarter_turns(rng, 4), 2),
    CaseFamily("half turns", sentence("Rotations by half a turn, of which w is 0."), _half_turns),
    CaseFamily("negative w",
               sentence("Quaternions with a negative w, which are rotations as good as any."),
               _negative),
    CaseFamily("slight", sentence("Rotations by a thousandth of a radian."), _slight),
    CaseFamily("no length", sentence("A link of no length."), _no_length),
    CaseFamily("arm at rest", sentence("The lab's arm, straight down."),
               lambda rng: skeletons.arm()),
    CaseFamily("arm", sentence("The lab's arm in a moved pose."), skeletons.moved_arm, 2),
    CaseFamily("branches", sentence("A root with three children."), _branches, 2),
    CaseFamily("chain", sentence("A chain in a moved pose."), chains(6), 2),
    CaseFamily("far away", sentence("A chain whose root is a hundred metres away."),
               chains(6, 100.0)),
    CaseFamily("tree", sentence("A tree in a moved pose."), trees(9), 3),
    CaseFamily("long chain", sentence("A chain of thirty joints: rounding adds up."), chains(30)),
    CaseFamily("large tree", sentence("A tree of thirty joints, as many as a character has."),
               trees(30)),
)  # fmt: skip


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return skeletons in moved poses, the smallest first."""
    return [
        Case(name, TASK, skeleton._asdict(), family.name, family.about,
             facts={"size": skeletons.extent(skeleton.offsets)})
        for name, family, skeleton in skeletons.drawn(FAMILIES, seed, 10 if thorough else 1)
        if skeletons.suits(skeleton.parents, greeting)
    ]  # fmt: skip


def judge(exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Compare positions and rotations separately with the reference; name the faults."""
    judgements = [_judge(exchange, greeting) for exchange in exchanges]
    wrong = [
        exchange
        for exchange, judgement in zip(exchanges, judgements, strict=True)
        if judgement.verdict > Verdict.RIGHT_BUT
    ]
    diagnosis = diagnosis_of("forward", exchanges, wrong, partial(_prediction_bound, greeting))
    return report(TASK, method, judgements, diagnosis)


def _prediction_bound(greeting: Greeting, case: Case) -> float:
    """Return the relative difference from a variant's answer that rounding explains."""
    joints = len(case.inputs["parents"])
    return max(1e-9, 4.0 * rounding.positions(greeting.epsilon, joints, 1.0))


def _judge(exchange: Exchange, greeting: Greeting) -> CaseJudgement:
    inputs, size = exchange.case.inputs, exchange.case.facts["size"]
    skeleton = Skeleton(inputs["parents"], inputs["offsets"])
    reference = partial(forward_kinematics, skeleton, inputs["local_rotations"])
    expected = reference()
    outputs = exchange.answer.values if isinstance(exchange.answer, Answer) else {}
    digits = min(_digits(outputs, expected, size), default=None)
    return laws.judge_case(
        exchange, greeting, lambda outputs: _findings(outputs, expected, size, greeting),
        reference, expected._asdict(), digits,
    )  # fmt: skip


def _digits(outputs: Mapping[str, Any], expected: Pose, size: float) -> Iterator[float]:
    """Yield the number of correct digits of each output; any multiple of q is one rotation."""
    if "positions" in outputs:
        error = np.linalg.norm(outputs["positions"] - expected.positions, axis=-1).max()
        yield laws.digits(error, size)
    if "rotations" in outputs:
        rotations = outputs["rotations"]
        with np.errstate(all="ignore"):  # infinite components give NaN
            lengths = np.linalg.norm(rotations, axis=-1, keepdims=True)
            unit = rotations / np.where(lengths > 0.0, lengths, 1.0)
        errors = (np.abs(unit - expected.rotations), np.abs(unit + expected.rotations))
        yield laws.digits(np.minimum(*(part.max(-1) for part in errors)).max(), 1.0)


def _findings(
    outputs: Mapping[str, Any], expected: Pose, size: float, greeting: Greeting
) -> Iterator[Finding]:
    joints = len(expected.positions)
    if "positions" in outputs:
        tolerance = rounding.positions(greeting.epsilon, joints, size)
        errors = np.linalg.norm(outputs["positions"] - expected.positions, axis=-1)
        message = sentence("Joint {joint} is {error:.2g} m off its position.")
        yield (
            laws.of_joints("positions", errors, tolerance, "m", message)
            if np.isfinite(errors).all()
            else laws.no_numbers("positions", errors, tolerance)
        )
    if "rotations" in outputs:
        bound = rounding.rotations(greeting.epsilon, joints)
        yield from _rotations(outputs["rotations"], expected.rotations, bound)


def _rotations(rotations: Any, expected: Any, bound: float) -> Iterator[Finding]:
    """Yield the findings about global rotations: their norms, and their angles once normalised."""
    lengths = np.linalg.norm(rotations, axis=-1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    if not usable.all():
        joint = int(np.argmin(usable))
        message = sentence("The rotation of joint {joint} is not a number or zero.", joint=joint)
        yield Finding("rotations", Verdict.WRONG, np.inf, bound, "rad", message, joint)
        return
    angles = laws.angles(rotations / lengths[:, None], expected)
    message = sentence("Joint {joint} is rotated {error:.2g} rad off.")
    yield laws.unit(lengths, bound)
    yield laws.of_joints("rotations", angles, bound, "rad", message)
