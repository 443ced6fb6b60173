"""Forward kinematics: where all joints are, and how they are rotated."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, rotation
from plumbob.reference.skeleton import Pose

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport
from ..laws import digits, finding, judge_case, not_finite, of_joints
from . import rounding, skeletons
from .pose_laws import unit_quaternions
from .report import report
from .skeletons import CaseFamily, drawn

TASK = "forward_kinematics"
# Below this w of a rotation a division by it has no meaning.
HALF_TURN = 1e-6


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return skeletons in moved poses, the smallest first."""
    return _drawn(TASK, greeting, seed, 10 if thorough else 1)


def telling_cases(greeting: Greeting, method: str, seed: int) -> list[Case]:
    """Return requests to ask after a wrong verdict: they tell joints apart."""
    return _drawn(f"{TASK}, telling", greeting, seed, 1)


def _drawn(section: str, greeting: Greeting, seed: int, repeats: int) -> list[Case]:
    return [
        Case(name, TASK, skeleton._asdict(), family.name, family.about,
             facts={"size": skeletons.extent(skeleton.offsets)})
        for name, family, skeleton in drawn(
            section, CaseFamily.pose, seed, repeats, greeting.planar
        )
        if skeletons.suits(skeleton.parents, greeting)
    ]  # fmt: skip


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Compare positions and rotations separately with the reference."""
    judgements = [_judge(exchange, greeting) for exchange in exchanges]
    return report(TASK, method, judgements)


def _judge(exchange: Exchange, greeting: Greeting) -> CaseJudgement:
    inputs, size = exchange.case.inputs, exchange.case.facts["size"]
    skeleton = Skeleton(inputs["parents"], inputs["offsets"])
    reference = partial(forward_kinematics, skeleton, inputs["local_rotations"])
    expected = reference()
    outputs = exchange.answer.values if isinstance(exchange.answer, Answer) else {}
    return judge_case(
        exchange, lambda outputs: _findings(outputs, expected, size, greeting),
        rounding.repeats(greeting.epsilon, size), reference, expected._asdict(),
        min(_digits(outputs, expected, size), default=None),
    )  # fmt: skip


def _digits(outputs: Mapping[str, Any], expected: Pose, size: float) -> Iterator[float]:
    """Yield the number of correct digits of each output; any multiple of q is one rotation."""
    if "positions" in outputs:
        error = np.linalg.norm(outputs["positions"] - expected.positions, axis=-1).max()
        yield digits(error, size)
    if "rotations" in outputs:
        rotations = outputs["rotations"]
        with np.errstate(all="ignore"):  # infinite components give NaN
            lengths = np.linalg.norm(rotations, axis=-1, keepdims=True)
            unit = rotations / np.where(lengths > 0.0, lengths, 1.0)
        errors = (np.abs(unit - expected.rotations), np.abs(unit + expected.rotations))
        yield digits(np.minimum(*(part.max(-1) for part in errors)).max(), 1.0)


def _findings(
    outputs: Mapping[str, Any], expected: Pose, size: float, greeting: Greeting
) -> Iterator[Finding]:
    joints = len(expected.positions)
    if "positions" in outputs:
        tolerance = rounding.positions(greeting.epsilon, joints, size)
        errors = np.linalg.norm(outputs["positions"] - expected.positions, axis=-1)
        is_finite = np.isfinite(errors).all()
        yield (
            of_joints("positions", errors, tolerance)
            if is_finite
            else not_finite("positions, not numbers", errors, tolerance)
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
        is_half = abs(expected[joint, 0]) < HALF_TURN
        key = "rotations, not numbers at half a turn" if is_half else "rotations, not numbers"
        yield finding(key, tolerance=bound, index=joint)
        return
    yield unit_quaternions(lengths, bound)
    angles = rotation.angle(rotations / lengths[:, None], expected)
    yield of_joints("rotations", angles, bound)
