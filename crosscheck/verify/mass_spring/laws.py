"""Laws that a step keeps whatever its solver is, and the laws of what it declares."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.judging.step import judge_step

from ..contestant import Answer, Asked
from ..judgement import Finding, Verdict
from ..sentence import Sentence, sentence
from .model import Model, simulate
from .problem import Problem, accelerations, damper_forces, state_of, system_of
from .rounding import SOLVED, Rounding, apart, difference

# Up to this share of what a step changes, an answer is called imprecise; beyond it is another step.
IMPRECISE = 1e-3
# So many times what rounding allows is imprecise as well.
ROUNDED = 30.0
# A small step's mean acceleration is off by about h omega, some hundredths.
CONSISTENT = 0.1


class Context(NamedTuple):
    """What the laws of one answer need.

    Attributes:
        answered: by the names of the outputs.
        model: the step that is declared, completed by what was inferred.
        known: whether that model is declared or was recognised.
        says: the model in words.
        expected: its prediction, or {} if it has none.
        pins_declared: whether the greeting says how pins are held.
    """

    problem: Problem
    answered: Mapping[str, Any]
    allowed: Rounding
    model: Model
    known: bool
    says: Sentence
    expected: Mapping[str, Any]
    pins_declared: bool


def finite(one: Context) -> Finding | None:
    """Return a finding if an answer holds NaN or infinity."""
    bad = [name for name, value in one.answered.items() if not np.isfinite(value).all()]
    if not bad:
        return None
    said = sentence("{name} hold NaN or infinity.", name=", ".join(bad))
    return Finding("finite numbers", Verdict.BROKEN, np.inf, 0.0, "", said)


def pins(one: Context) -> Finding | None:
    """Return how far pins are from where they were."""
    p = one.problem
    if len(p.pinned) == 0 or "positions" not in one.answered:
        return None
    moved = np.linalg.norm(one.answered["positions"] - p.positions, axis=-1)[..., p.pinned]
    moved = moved.reshape(-1, len(p.pinned)).max(axis=0)
    worst = float(moved.max())
    held = one.model.pins in ("eliminated", "overwritten") and one.pins_declared
    verdict = Verdict.RIGHT if worst <= one.allowed.positions else Verdict.WRONG
    tolerance = one.allowed.positions
    if not held and verdict is Verdict.WRONG:
        tolerance += IMPRECISE * float(np.abs(one.answered["positions"] - p.positions).max())
        if one.expected:
            there = np.asarray(one.expected["positions"]) - p.positions
            tolerance += 2.0 * float(np.abs(there[..., p.pinned, :]).max())
        verdict = Verdict.RIGHT_BUT if worst <= tolerance else Verdict.WRONG
    said = sentence("A pinned particle moves by {error:.2g} m.", error=worst)
    where = int(p.pinned[moved.argmax()])
    return Finding("pins", verdict, worst, tolerance, "m", said, where)


def declared_step(one: Context) -> Finding | None:
    """Return how far positions are from those of the declared or recognised step."""
    if "positions" not in one.answered:
        return None
    law = "declared step"
    if not one.known:
        said = sentence("The step is none of those that are known; none was declared.")
        return Finding(law, Verdict.UNDECIDED, np.inf, SOLVED, "", said)
    if not one.expected or not np.isfinite(one.expected["positions"]).all():
        said = sentence("The declared step has no finite result here.")
        return Finding(law, Verdict.UNDECIDED, np.inf, SOLVED, "", said)
    answered = {"positions": one.answered["positions"]}
    error = apart(one.problem, one.expected, answered, one.allowed)
    gap = np.linalg.norm(one.expected["positions"] - answered["positions"], axis=-1)
    where = int(gap.reshape(-1, one.problem.count).max(axis=0).argmax())
    said = sentence(
        "Positions are up to {gap:.2g} m from those of {model}, at particle {where}.",
        gap=float(gap.max()), model=one.says, where=where,
    )  # fmt: skip
    moved = float(np.abs(one.expected["positions"] - one.problem.positions).max())
    verdict = _graded(error, moved, one.allowed.positions)
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
    p, how = one.problem, one.model.integrator
    moved = float(np.abs(np.asarray(one.expected["positions"]) - p.positions).max())
    if one.allowed.positions > moved:
        return Verdict.UNDECIDED
    if how.method == "newton" and _indefinite(one):
        return Verdict.UNDECIDED
    if how.method == "converged" and one.model.substeps == 1 and one.model.scaling == 1.0:
        found = minimum(one)
        if found is not None and found.certificate.covered:
            near = found.certificate.distance <= IMPRECISE * found.displacement
            return Verdict.RIGHT if near else Verdict.WRONG
    return Verdict.WRONG


def _indefinite(one: Context) -> bool:
    """Return whether Newton's method may meet a Hessian that no two programs mend alike."""
    p = one.problem
    length = np.linalg.norm(p.positions[p.springs[:, 0]] - p.positions[p.springs[:, 1]], axis=1)
    lost = p.stiffnesses * np.maximum(p.rest_lengths / length - 1.0, 0.0) * p.h**2
    return bool((np.abs(p.incidence).T @ lost > 0.1 * p.masses).any())


def minimum(one: Context) -> Any:
    """Return the judgement of positions as a converged implicit step; None if none applies."""
    p, model = one.problem, one.model
    external = p.external
    if model.damper == "explicit":
        external = external + damper_forces(p, p.positions, p.velocities)
    elif model.damper != "length_rate" and p.damped:
        return None
    if model.damper != "length_rate":
        p = p.changed(dampings=np.zeros_like(p.dampings))
    if p.steps:
        return None
    return judge_step(system_of(p), state_of(p), p.h, one.answered["positions"], None, external)


def minimiser(one: Context) -> Finding | None:
    """Return how far positions are from converged implicit Euler, relative to how far y is."""
    if "positions" not in one.answered or one.problem.steps:
        return None
    found = minimum(one)
    if found is None or not found.outcome.solved:
        return None
    rounded = found.distance <= one.allowed.positions * np.sqrt(3.0 * one.problem.count)
    if found.error <= SOLVED or rounded or found.same_minimiser is False:
        said = sentence("The step is the converged one of implicit Euler.")
        return Finding("minimiser", Verdict.RIGHT, found.error, SOLVED, "", said)
    if not one.known:
        said = sentence("It is {distance:.2g} m from the minimiser of implicit Euler.",
                        distance=found.distance)  # fmt: skip
        return Finding("minimiser", Verdict.UNDECIDED, found.error, SOLVED, "", said)
    said = sentence(
        "Not converged implicit Euler: the positions miss its minimiser x* by {error:.2g} of "
        "|y - x*|, what springs move in a step.",
        error=found.error,
    )  # fmt: skip
    return Finding("minimiser", Verdict.RIGHT_BUT, found.error, SOLVED, "", said)


def velocities(one: Context) -> Finding | None:
    """Return how far velocities are from what the declared making gives."""
    if "velocities" not in one.answered or not one.known or not one.expected:
        return None
    wanted = np.asarray(one.expected["velocities"])
    p, x = one.problem, one.answered.get("positions")
    by_displacement = one.model.velocity == "displacement" and not one.model.integrator.explicit
    if by_displacement and one.model.substeps == 1 and x is not None and not p.steps:
        wanted = (x - p.positions) / p.h * one.model.scaling
    gap = difference(p, "velocities", wanted, one.answered["velocities"])
    size = float(np.abs(wanted).max(initial=0.0))
    error = gap / (size + one.allowed.velocities / SOLVED)
    said = sentence("Velocities are up to {gap:.2g} m/s from what the step makes them.", gap=gap)
    verdict = Verdict.UNDECIDED
    if np.isfinite(gap):
        verdict = _graded(error, size, one.allowed.velocities)
    return Finding("velocities", verdict, error, SOLVED, "", said)


def momentum(one: Context) -> Finding | None:
    """Return how far the centre of mass is from where gravity takes it, without pins."""
    p, x = one.problem, one.answered.get("positions")
    how = one.model.integrator.method
    if x is None or len(p.pinned) or p.steps or how == "descent" or one.model.scaling != 1.0:
        return None
    if one.model.damper in ("diagonal", "blocks"):
        return None  # each end has its own share of a damper there
    share = p.masses / p.masses.sum()
    fall = p.h**2 * (p.constant.sum(0) / p.masses.sum())
    drift = share @ (x - p.positions - p.h * p.velocities)
    size = float(fall @ fall)
    part = float(np.clip(drift @ fall / size, 0.0, 1.0)) if size else 0.0
    gap = float(np.linalg.norm(drift - part * fall))
    tolerance = 4.0 * one.allowed.positions
    if one.model.integrator.method == "converged":
        tolerance += 1e-4 * float(np.abs(x - p.positions).max())
    said = sentence("Springs move the centre of mass by {gap:.2g} m; they cannot.", gap=gap)
    verdict = Verdict.RIGHT if gap <= tolerance else Verdict.WRONG
    return Finding("momentum", verdict, gap, tolerance, "m", said)


def consistency(one: Context) -> Finding | None:
    """Return how far the mean acceleration of a small step is from f / m."""
    p = one.problem
    v = one.answered.get("velocities")
    if v is None or one.model.damper == "none" or one.model.scaling != 1.0:
        return None  # without velocities explicit and implicit steps part at the first order
    a = (v - p.velocities) / p.h
    wanted = accelerations(p, p.positions, p.velocities)
    free = np.setdiff1d(np.arange(p.count), p.pinned)
    gap = float(np.abs(a - wanted)[free].max())
    scale = float(np.abs(wanted[free]).max())
    tolerance = CONSISTENT * scale + 2.0 * one.allowed.velocities / p.h
    said = sentence(
        "In a small step the acceleration is {gap:.2g} m/s² off f / m, of {scale:.2g} m/s².",
        gap=gap, scale=scale,
    )  # fmt: skip
    verdict = Verdict.RIGHT if gap <= tolerance else Verdict.WRONG
    return Finding("consistency", verdict, gap, tolerance, "m/s²", said)


def equal_requests(asked: Asked, names: tuple[str, ...], allowed: Mapping[str, float]) -> Finding:
    """Return how far two answers to one request are apart."""
    again = asked.again
    if not isinstance(asked.answer, Answer) or not isinstance(again, Answer):
        said = sentence("Asked a second time, it gave no answer.")
        return Finding("equal requests", Verdict.BROKEN, np.inf, 0.0, "", said)
    shared = [name for name in names if name in asked.answer.values and name in again.values]
    gaps = {name: _gap(asked.answer.values[name], again.values[name]) for name in shared}
    worst = max(shared, key=lambda name: gaps[name] / max(allowed[name], 1e-300), default="")
    gap, tolerance = gaps.get(worst, 0.0), allowed.get(worst, 0.0)
    said = sentence(
        "Two answers to the same request differ by {gap:.2g} in {name}: it starts from noise, "
        "keeps state, or reads memory that was never written.",
        gap=gap, name=worst,
    ) if gap else sentence("Equal requests have equal answers.")  # fmt: skip
    verdict = Verdict.RIGHT if gap <= tolerance else Verdict.WRONG
    return Finding("equal requests", verdict, gap, tolerance, "", said)


def _gap(one: Any, other: Any) -> float:
    a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return np.inf
    return float(np.abs(np.nan_to_num(a) - np.nan_to_num(b)).max(initial=0.0))


def symmetry(asked: Asked, base: Answer, allowed: Mapping[str, float]) -> Finding:
    """Return how far the answer is from the transformed answer to the untransformed case."""
    facts = asked.case.facts
    assert isinstance(asked.answer, Answer)
    worst, where, name = 0.0, None, ""
    for key in ("positions", "velocities", "forces"):
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
    verdict = Verdict.RIGHT if worst <= 1.0 else Verdict.WRONG
    return Finding("symmetry", verdict, worst, 1.0, "", said, where)


def _transformed(values: FloatArray, facts: Mapping[str, Any], place: bool) -> FloatArray:
    moved = values @ facts["matrix"].T + (facts["shift"] if place else 0.0)
    return moved[..., np.argsort(facts["order"]), :]


def predicted(p: Problem, model: Model) -> Mapping[str, Any]:
    """Return the model's result, {} if its matrix is singular."""
    with np.errstate(all="ignore"):
        try:
            return simulate(p, model)
        except np.linalg.LinAlgError:
            return {}
