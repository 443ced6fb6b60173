"""Laws that a step keeps whatever its solver is, and the laws of what it declares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.judging import StepJudgement, judge_step

from ..contestant import Answer, Exchange
from ..explain import largest_gap
from ..judgement import Finding, Verdict
from ..sentence import Sentence, sentence
from .model import StepModel
from .problem import SpringProblem, accelerations, damper_forces, frames, state_of, system_of
from .rounding import SOLVED, Rounding, apart, difference

# Up to this share of what a step changes, an answer is called imprecise; beyond it is another step.
IMPRECISE = 1e-3
# So many times what rounding allows is imprecise as well.
ROUNDED = 30.0
# A small step's mean acceleration is off by about h omega, some hundredths.
CONSISTENT = 0.1


@dataclass(frozen=True, eq=False)
class Context:
    """What the laws of one answer need."""

    problem: SpringProblem
    answered: Mapping[str, Any]  # by the names of the outputs
    allowed: Rounding
    model: StepModel  # the step that is declared, completed by what was inferred
    known: bool  # whether that model is declared or was recognised
    says: Sentence  # the model in words
    expected: Mapping[str, Any]  # its prediction, or {} if it has none
    pins_declared: bool  # whether the greeting says how pins are held

    @cached_property
    def judgement(self) -> StepJudgement | None:
        """The positions judged as a converged implicit step, None where its damper is no energy."""
        p, damper = self.problem, self.model.damper
        external = p.external
        if p.steps or (p.damped and damper not in ("explicit", "length_rate")):
            return None
        if damper == "explicit":
            external = external + damper_forces(p, p.positions, p.velocities)
        if damper != "length_rate":
            p = p.changed(dampings=np.zeros_like(p.dampings))
        x = self.answered["positions"]
        return judge_step(system_of(p), state_of(p), p.h, x, external_forces=external)

    def displacement(self, name: str = "positions") -> float:
        """Return by how much positions or velocities are expected to change, at most."""
        before = self.problem.positions if name == "positions" else 0.0
        return float(np.abs(np.asarray(self.expected[name]) - before).max(initial=0.0))


def bounded(
    law: str, error: float, tolerance: float, unit: str, said: Sentence, where: int | None = None
) -> Finding:
    """Return the finding that an error is within its tolerance, or wrong."""
    verdict = Verdict.RIGHT if error <= tolerance else Verdict.WRONG
    return Finding(law, verdict, error, tolerance, unit, said, where)


def unsure(law: str, error: float, said: Sentence) -> Finding:
    """Return the finding that nobody can tell whether a law holds."""
    return Finding(law, Verdict.UNDECIDED, error, SOLVED, "", said)


def no_numbers(said: Sentence) -> Finding:
    """Return the finding that an answer holds NaN or infinity."""
    return Finding("finite numbers", Verdict.BROKEN, np.inf, 0.0, "", said)


def remarks(answer: Answer) -> list[Finding]:
    """Return what was odd about an answer."""
    return [Finding("remarks", Verdict.RIGHT_BUT, 0, 0, "", said) for said in answer.remarks]


def finite(one: Context) -> Finding | None:
    """Return a finding if an answer holds NaN or infinity."""
    bad = [name for name, value in one.answered.items() if not np.isfinite(value).all()]
    return (
        no_numbers(sentence("{name} hold NaN or infinity.", name=", ".join(bad))) if bad else None
    )


def pins(one: Context) -> Finding | None:
    """Return how far pins are from where they were."""
    p, x = one.problem, one.answered.get("positions")
    if len(p.pinned) == 0 or x is None:
        return None
    moved = np.linalg.norm(x - p.positions, axis=-1)[..., p.pinned].reshape(-1, len(p.pinned))
    worst, tolerance = float(moved.max()), one.allowed.positions
    held = one.model.pins in ("eliminated", "overwritten") and one.pins_declared
    verdict = Verdict.RIGHT if worst <= tolerance else Verdict.WRONG
    if not held and verdict is Verdict.WRONG:
        tolerance += IMPRECISE * float(np.abs(x - p.positions).max())
        if one.expected:
            there = np.asarray(one.expected["positions"]) - p.positions
            tolerance += 2.0 * float(np.abs(there[..., p.pinned, :]).max())
        verdict = Verdict.RIGHT_BUT if worst <= tolerance else Verdict.WRONG
    said = sentence("A pinned particle moves by {error:.2g} m.", error=worst)
    where = int(p.pinned[moved.max(axis=0).argmax()])
    return Finding("pins", verdict, worst, tolerance, "m", said, where)


def declared_step(one: Context) -> Finding | None:
    """Return how far positions are from those of the declared or recognised step."""
    law = "declared step"
    if "positions" not in one.answered:
        return None
    if not one.known:
        return unsure(
            law, np.inf, sentence("The step is none of those that are known; none was declared.")
        )
    if not one.expected or not np.isfinite(one.expected["positions"]).all():
        return unsure(law, np.inf, sentence("The declared step has no finite result here."))
    answered = {"positions": one.answered["positions"]}
    error = apart(one.problem, one.expected, answered, one.allowed)
    gap = np.linalg.norm(one.expected["positions"] - answered["positions"], axis=-1)
    where = int(gap.reshape(-1, one.problem.count).max(axis=0).argmax())
    said = sentence(
        "Positions are up to {gap:.2g} m from those of {model}, at particle {where}.",
        gap=float(gap.max()),
        model=one.says,
        where=where,
    )
    verdict = _graded(error, one.displacement(), one.allowed.positions)
    if verdict is Verdict.WRONG and not one.problem.steps:
        verdict = _excused(one)
    return Finding(law, verdict, error, SOLVED, "", said, where)


def _graded(error: float, size: float, allowed: float) -> Verdict:
    """Return what follows from an error relative to a size with its rounding."""
    if error <= SOLVED:
        return Verdict.RIGHT
    gap = error * (size + allowed / SOLVED)
    return Verdict.RIGHT_BUT if gap <= IMPRECISE * size + ROUNDED * allowed else Verdict.WRONG


def _excused(one: Context) -> Verdict:
    """Return whether a step that differs is another minimum, or rests on a safeguard."""
    method, model = one.model.integrator.method, one.model
    if one.allowed.positions > one.displacement() or (method == "newton" and _indefinite(one)):
        return Verdict.UNDECIDED
    if method == "converged" and model.substeps == 1 and model.scaling == 1.0:
        judgement = one.judgement
        if judgement is not None and judgement.certificate.covered:
            near = judgement.certificate.distance <= IMPRECISE * judgement.displacement
            return Verdict.RIGHT if near else Verdict.WRONG
    return Verdict.WRONG


def _indefinite(one: Context) -> bool:
    """Return whether Newton's method may meet a Hessian that no two programs mend alike."""
    p = one.problem
    length, _ = frames(p, p.positions)
    lost = p.stiffnesses * np.maximum(p.rest_lengths / length - 1.0, 0.0) * p.h**2
    return bool((np.abs(p.incidence).T @ lost > 0.1 * p.masses).any())


def minimiser(one: Context) -> Finding | None:
    """Return how far positions are from converged implicit Euler, relative to how far y is."""
    law = "minimiser"
    if "positions" not in one.answered:
        return None
    judgement = one.judgement
    if judgement is None or not judgement.outcome.solved:
        return None
    error = judgement.error
    rounded = judgement.distance <= one.allowed.positions * np.sqrt(3.0 * one.problem.count)
    if error <= SOLVED or rounded or judgement.same_minimiser is False:
        said = sentence("The step is the converged one of implicit Euler.")
        return Finding(law, Verdict.RIGHT, error, SOLVED, "", said)
    if not one.known:
        return unsure(law, error, sentence(
            "It is {distance:.2g} m from the minimiser of implicit Euler.",
            distance=judgement.distance))  # fmt: skip
    said = sentence(
        "Not converged implicit Euler: the positions miss its minimiser x* by {error:.2g} of "
        "|y - x*|, what springs move in a step.",
        error=error,
    )
    return Finding(law, Verdict.RIGHT_BUT, error, SOLVED, "", said)


def velocities(one: Context) -> Finding | None:
    """Return how far velocities are from what the declared making gives."""
    if "velocities" not in one.answered or not one.known or not one.expected:
        return None
    wanted, model = np.asarray(one.expected["velocities"]), one.model
    p, x = one.problem, one.answered.get("positions")
    by_displacement = model.velocity == "displacement" and not model.integrator.explicit
    if by_displacement and model.substeps == 1 and x is not None and not p.steps:
        wanted = (x - p.positions) / p.h * model.scaling
    gap = difference(p, "velocities", wanted, one.answered["velocities"])
    size = float(np.abs(wanted).max(initial=0.0))
    error = gap / (size + one.allowed.velocities / SOLVED)
    said = sentence("Velocities are up to {gap:.2g} m/s from what the step makes them.", gap=gap)
    finite = np.isfinite(gap)
    verdict = _graded(error, size, one.allowed.velocities) if finite else Verdict.UNDECIDED
    return Finding("velocities", verdict, error, SOLVED, "", said)


def momentum(one: Context) -> Finding | None:
    """Return how far the centre of mass is from where gravity takes it, without pins."""
    p, x, model = one.problem, one.answered.get("positions"), one.model
    method = model.integrator.method
    if x is None or len(p.pinned) or p.steps or method == "descent" or model.scaling != 1.0:
        return None
    if model.damper in ("diagonal", "blocks"):
        return None  # each end has its own share of a damper there
    share = p.masses / p.masses.sum()
    fall = p.h**2 * (p.constant.sum(0) / p.masses.sum())
    drift = share @ (x - p.positions - p.h * p.velocities)
    size = float(fall @ fall)
    part = float(np.clip(drift @ fall / size, 0.0, 1.0)) if size else 0.0
    gap = float(np.linalg.norm(drift - part * fall))
    tolerance = 4.0 * one.allowed.positions
    if method == "converged":
        tolerance += 1e-4 * float(np.abs(x - p.positions).max())
    said = sentence("Springs move the centre of mass by {gap:.2g} m; they cannot.", gap=gap)
    return bounded("momentum", gap, tolerance, "m", said)


def consistency(one: Context) -> Finding | None:
    """Return how far the mean acceleration of a small step is from f / m."""
    p, v = one.problem, one.answered.get("velocities")
    if v is None or one.model.damper == "none" or one.model.scaling != 1.0:
        return None  # without velocities explicit and implicit steps part at the first order
    wanted = accelerations(p, p.positions, p.velocities)
    free = np.setdiff1d(np.arange(p.count), p.pinned)
    gap = float(np.abs((v - p.velocities) / p.h - wanted)[free].max())
    scale = float(np.abs(wanted[free]).max())
    said = sentence(
        "In a small step the acceleration is {gap:.2g} m/s² off f / m, of {scale:.2g} m/s².",
        gap=gap,
        scale=scale,
    )
    tolerance = CONSISTENT * scale + 2.0 * one.allowed.velocities / p.h
    return bounded("consistency", gap, tolerance, "m/s²", said)


def equal_requests(asked: Exchange, allowed: Mapping[str, float]) -> Finding:
    """Return how far two answers to one request are apart, in the outputs that are named."""
    answer, again = asked.answer, asked.repeat
    if not isinstance(answer, Answer) or not isinstance(again, Answer):
        said = sentence("Asked a second time, it gave no answer.")
        return Finding("equal requests", Verdict.BROKEN, np.inf, 0.0, "", said)
    gaps = {
        name: largest_gap(answer.values[name], again.values[name])
        for name in allowed
        if name in answer.values and name in again.values
    }
    worst = max(gaps, key=lambda name: gaps[name] / max(allowed[name], 1e-300), default="")
    gap, tolerance = gaps.get(worst, 0.0), allowed.get(worst, 0.0)
    said = sentence(
        "Two answers to the same request differ by {gap:.2g} in {name}: it starts from noise, "
        "keeps state, or reads memory that was never written.",
        gap=gap, name=worst,
    ) if gap else sentence("Equal requests have equal answers.")  # fmt: skip
    return bounded("equal requests", gap, tolerance, "", said)


def symmetry(
    asked: Exchange, every: Sequence[Exchange], allowed: Mapping[str, float]
) -> Finding | None:
    """Return how far the answer is from the transformed answer to the untransformed case."""
    facts = asked.case.facts
    base = next((one.answer for one in every if one.case.name == facts.get("of")), None)
    if not isinstance(base, Answer) or not isinstance(asked.answer, Answer):
        return None
    worst, where, name = 0.0, None, ""
    for key in allowed:
        if key not in asked.answer.values or key not in base.values:
            continue
        wanted = _transformed(base.values[key], facts, key == "positions")
        gap = np.linalg.norm(asked.answer.values[key] - wanted, axis=-1)
        gap = gap.reshape(-1, gap.shape[-1]).max(axis=0)
        ratio = float(gap.max()) / allowed[key]
        if not ratio <= worst:
            worst, where, name = ratio, int(gap.argmax()), key
    said = sentence(
        "Where space or the numbering is changed, {name} change otherwise than they should, "
        "most at particle {where}.",
        name=name, where=where,
    ) if worst > 1.0 else sentence("Space and numbering make no difference.")  # fmt: skip
    return bounded("symmetry", worst, 1.0, "", said, where)


def _transformed(values: FloatArray, facts: Mapping[str, Any], place: bool) -> FloatArray:
    moved = values @ facts["matrix"].T + (facts["shift"] if place else 0.0)
    return moved[..., np.argsort(facts["order"]), :]
