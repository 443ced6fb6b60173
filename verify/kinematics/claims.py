"""Claims of answers: formulas that give their residual, their success or their positions.

The entries of the table `claim` in `faults.toml` name an output, and the formula of this output in
a program with the fault, for any method. The names in formulas are those of `values_of`.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import CodeType
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, local_from_global
from plumbob.text.sentence import Sentence, codes_in, with_code

from ..case import Case
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from .faults import TABLE
from .pose_laws import AnsweredPose
from .predictions import solve

# What an output is in a right program. The rotations of an answer are compared as positions by
# these rotations, the `placed` positions.
RIGHT = {
    "residual": "distance",
    "converged": "distance <= tolerance",
    "iterations": "sweeps",
    "positions": "placed",
    "placed": "positions",
}
# Claims by a false residual, and claims of a solver with the belief to be at its target.
FOLLOWS = "success by the reported residual"
BELIEVED = {FOLLOWS, "success where it gave up", "success where sweeps are left"}
# The laws broken by false outputs, beside laws broken by poses.
LAWS = {"claims", "root in place", "link lengths", "branches", "rotations agree with positions"}
# The least number of answers to compare with a formula, and the share to match.
MIN_ANSWERS, MIN_SHARE = 4, 0.9
# Positions within this share of the skeleton's size are the same, by precision. Positions after
# sweeps may differ by so many times as much.
SAME, AFTER_SWEEPS = {"double": 1e-9, "single": 1e-4}, 1e3
NAMES = {
    "abs": np.abs, "norm": np.linalg.norm, "np": np, "where": np.where,
    "without": lambda v, axis: np.delete(v, "xyz".index(axis)),
}  # fmt: skip


class ClaimFault(NamedTuple):
    """A formula that gives an output of programs with a fault."""

    key: str
    output: str
    formula: CodeType
    sentence: Sentence


def _load() -> Iterator[ClaimFault]:
    for key, entry in TABLE["claim"].items():
        choices = entry.get("each", {})
        for choice in itertools.product(*choices.values()):
            fields = dict(zip(choices, choice, strict=True))
            formula = compile(entry["formula"].format(**fields), key, "eval")
            words = with_code(entry["code"], Sentence(entry["sentence"], fields))
            yield ClaimFault(key.format(**fields), entry["output"], formula, words)


FAULTS = tuple(_load())
OF_POSES = {fault.key for fault in FAULTS if fault.output in ("positions", "placed")}
# The codes of claims that wrong poses may lead to.
OF_WRONG_POSES = {
    code
    for fault in FAULTS
    if fault.output in ("residual", "converged")
    for code in codes_in(fault.sentence)
}
OF_RESIDUALS = {fault.key for fault in FAULTS if fault.output == "residual"}
TRUTHS = {output: compile(formula, output, "eval") for output, formula in RIGHT.items()}


def values_of(
    case: Case,
    poses: Sequence[AnsweredPose],
    outputs: Mapping[str, Any],
    method: str,
    greeting: Greeting,
) -> dict[str, Any]:
    """Return the values of the names in formulas, for the pose of a solve or those of all frames.

    Positions are (frame, joint, 3). `method` is one of the textbook's or "".
    """
    inputs, effector, parents = case.inputs, case.inputs["effector"], case.inputs["parents"]
    skeleton, path = Skeleton(parents, inputs["offsets"]), case.facts["path"]
    same = SAME[greeting.precision] * case.facts["size"]
    values = {
        **{name: outputs[name] for name in RIGHT if name in outputs}, "same": same,
        "tolerance": inputs["tolerance"], "limit": inputs["max_iterations"],
    }  # fmt: skip
    values.pop("positions", None)
    if "target" in inputs:
        gaps = poses[0].positions - inputs["target"]
        children = np.flatnonzero(parents == effector)
        neighbours = {"parent": parents[effector]} | dict(zip(["child"], children, strict=False))
        values |= {f"{name}_distance": np.linalg.norm(gaps[j]) for name, j in neighbours.items()}
        values |= {"gap": gaps[effector], "distance": np.linalg.norm(gaps[effector])}
        values |= {name: case.facts[name] for name in ("least", "reach")}
        values |= {"start_distance": case.facts["before"], "links": len(path) - 1}
        values |= _sweeps(method, case, poses[0], outputs, same) if method else {}
    if all(pose.local is not None and pose.answered_positions is not None for pose in poses):
        q, positions, placed = (
            np.array([getattr(pose, name) for pose in poses])
            for name in ("local", "answered_positions", "positions")
        )
        start = forward_kinematics(skeleton, inputs["local_rotations"]).positions[None]
        joints = np.arange(len(parents))
        masks = {"path": np.isin(joints, path), "effector": joints == effector}
        values |= {name: mask[:, None] for name, mask in masks.items()} | {
            "q": q, "positions": positions, "placed": placed, "start": start,
            "placed_before": np.concatenate([start, placed[:-1]]),
            "positions_before": np.concatenate([start, positions[:-1]]),
            "targets": np.reshape(inputs.get("target", inputs.get("curve")), (-1, 1, 3)),
            "forward": lambda q: forward_kinematics(skeleton, q),
            "local": lambda q: local_from_global(skeleton, q),
        }  # fmt: skip
    return values


def _sweeps(
    method: str, case: Case, pose: AnsweredPose, outputs: Mapping[str, Any], same: float
) -> dict[str, Any]:
    """Return the sweeps of a pose and the distance before the last, {} if it is no textbook's."""
    inputs, needed = {**case.inputs, "tolerance": 0.0}, solve(method, case.inputs)[2]
    for count in (needed, int(outputs.get("iterations", needed))):
        after, before = (
            solve(method, {**inputs, "max_iterations": max(sweeps, 0)})[1]
            for sweeps in (count, count - 1)
        )
        if pose.distance_to(after) <= AFTER_SWEEPS * same:
            gap = before[inputs["effector"]] - inputs["target"]
            return {"sweeps": count, "distance_before": np.linalg.norm(gap)}
    return {}


def explanations(answers: Sequence[Mapping[str, Any]]) -> list[Explanation]:
    """Return for each wrong output the fault with most of its answers, if any.

    The fault gives nearly all numbers, and all booleans.
    """
    explanations = []
    for output, truth in TRUTHS.items():
        reports = [values for values in answers if output in values]
        wrong = [values for values in reports if _agrees(truth, output, values) is False]
        shares = [
            (min(_share(fault, reports), _share(fault, wrong)), -number, fault)
            for number, fault in enumerate(FAULTS)
            if fault.output == output and wrong and len(reports) >= MIN_ANSWERS
        ]
        share, _, fault = max(shares, default=(0.0, 0, None))
        if fault and share >= (1.0 if output == "converged" else MIN_SHARE):
            explanations.append(Explanation((fault.key,), fault.sentence, share, 0.0))
    return explanations


def _share(fault: ClaimFault, answers: Sequence[Mapping[str, Any]]) -> float:
    """Return a fault's share of answers, among the answers with a number by the fault."""
    matches = [_agrees(fault.formula, fault.output, values) for values in answers]
    return matches.count(True) / max(len(matches) - matches.count(None), 1)


def _agrees(formula: CodeType, output: str, values: Mapping[str, Any]) -> bool | None:
    """Return whether a formula gives an output, None without a number or if rounding decides."""
    try:
        with np.errstate(all="ignore"):
            low, high = (
                eval(formula, NAMES, {**values, "tolerance": values["tolerance"] + slack})
                for slack in (-values["same"], values["same"])
            )
    except NameError:
        return None
    if isinstance(low, bool | np.bool_):
        return bool(values[output]) == bool(low) if low == high else None
    gap = float(np.abs(values[output] - low).max())
    return None if np.isnan(gap) else gap <= AFTER_SWEEPS * values["same"]


def _ends_by_residual(diagnosis: Diagnosis, answers: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether solves end by their reported residual, where all else is right."""
    faults = {key for explanation in diagnosis.explanations for key in explanation.faults}
    return bool(faults) and faults <= TABLE["stop"].keys() and all(
        values["residual"] <= values["tolerance"] + values["same"]
        or values.get("iterations", values["limit"]) >= values["limit"]
        for values in answers
        if "residual" in values
    )  # fmt: skip


def with_claims(
    diagnosis: Diagnosis,
    judgements: Sequence[CaseJudgement],
    answers: Sequence[Mapping[str, Any]],
    is_placed: bool,
) -> Diagnosis:
    """Return a diagnosis with the faults of what answers say, where a law about that is broken.

    They come first if nothing else is wrong, and stand beside other mistakes if not. Positions say
    something unless what places the joints is known to be wrong (`is_placed`).
    """
    findings = [finding for judgement in judgements for finding in judgement.findings]
    broken = {finding.law for finding in findings if finding.verdict >= Verdict.WRONG}
    is_false = broken & LAWS or any(entry.law == "claims" and entry.verdict for entry in findings)
    claims = explanations(answers) if is_false else []
    if claims and claims[0].faults[0] in OF_RESIDUALS and _ends_by_residual(diagnosis, answers):
        diagnosis = replace(diagnosis, explanations=tuple(claims[:1]))
        claims = claims[1:]
    is_certain = any(explanation.share == 1.0 for explanation in diagnosis.explanations)
    of_poses = [claim for claim in claims if claim.faults[0] in OF_POSES]
    claims = [claim for claim in claims if claim not in of_poses]
    if is_placed and not is_certain:
        claims = [*of_poses, *claims]
        if claims and (of_poses or broken <= LAWS):
            diagnosis = replace(diagnosis, explanations=tuple(claims[:1]))
            claims = claims[1:]
    faults = {key for explanation in diagnosis.explanations for key in explanation.faults}
    follow = BELIEVED if is_certain and not faults & TABLE["stop"].keys() else {FOLLOWS}
    if diagnosis.explanations or len(claims) > 1 or broken - LAWS - {"claims"}:
        claims = [claim for claim in claims if claim.faults[0] not in follow]
    return replace(diagnosis, hints=(*(claim.sentence for claim in claims), *diagnosis.hints))
