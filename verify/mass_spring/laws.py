"""Laws of every step and of the declared step of a solver, and the allowed rounding."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.judging import StepJudgement, judge_step
from plumbob.text.sentence import Sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Step
from ..judgement import Finding, Verdict
from ..laws import finding
from .honest import ITERATIVE
from .model import EXPLICIT, Scaling, StepModel
from .problem import SpringProblem, accelerations, damper_forces, frames, state_of, system_of

# A sum of some ten terms, a few products and a square root, each rounded by half an epsilon, like
# the inputs in single precision.
ROUNDINGS = 4.0
# What an iterative linear solver may leave of a displacement, and a velocity, without being taken
# for another model.
SOLVED = 1e-6
# Up to this share of what a step changes, an answer is called imprecise; beyond it is another step.
IMPRECISE = 1e-3
# So many times what rounding allows is imprecise as well.
ROUNDED = 30.0
# A small step's mean acceleration is off by about h omega, some hundredths.
CONSISTENT = 0.1
# Positions beyond this [m] are none that the reference judges.
LARGEST = 1e75
# The share of the largest displacement by which a pin may move without being declared.
HELD = 0.1
# The share of the largest displacement that a solver of nonlinear equations may leave to momentum.
UNBALANCED = 1e-4


class Rounding(NamedTuple):
    """Bounds of a rounding error."""

    positions: float  # [m]
    velocities: float  # [m/s]


def rounding(p: SpringProblem, model: StepModel, epsilon: float) -> Rounding:
    """Return bounds for an honest solver of that precision.

    A coordinate is rounded by epsilon of its size in each substep, always to the same side where
    the increments are alike. Lengths are rounded like coordinates, and h² k / m of lengths enters
    the right-hand side of a step. The condition of M + h² L is 1 + h² k / m. An unstable explicit
    step multiplies earlier errors by hs² k / m. The largest eigenvalue of M^-1 L is bounded by the
    largest sum of |k| + |c| / h over the springs of a particle, times 2 / m.
    """
    n, steps, growth = model.substeps, p.steps or 1, 1.0
    if model.integrator.explicit:
        growth = min(max(1.0, stiffness_of(p) / n**2) ** (n - 1), 1e12)
    size = np.abs(p.positions).max() + p.h * steps * np.abs(p.velocities).max()
    size += (p.h * steps) ** 2 * float(np.linalg.norm(p.gravity))
    x = ROUNDINGS * epsilon * size * (1.0 + n + stiffness_of(p)) * growth * steps**2
    v = 2.0 * x / p.h + ROUNDINGS * epsilon * float(np.abs(p.velocities).max())
    return Rounding(float(x), float(v))


def stiffness_of(p: SpringProblem) -> float:
    """Return h² times a bound of the largest eigenvalue of M^-1 L, dampers included."""
    stiffness = np.abs(p.stiffnesses) + np.abs(p.dampings) / p.h
    sums = 2.0 * np.abs(p.incidence).T @ stiffness / p.masses
    return p.h**2 * float(sums.max(initial=0.0))


def relative_gap(
    p: SpringProblem, predicted: Mapping[str, Any], answers: Mapping[str, Any], allowed: Rounding
) -> float:
    """Return the largest difference of positions and velocities, over their changes.

    Rounding counts as no difference; so a number above SOLVED means another step. Velocities of
    pins are left out, for they affect no position.
    """
    gaps = [
        coordinate_gap(p, name, predicted[name], answers[name])
        / (np.abs(predicted[name] - before).max(initial=0.0) + getattr(allowed, name) / SOLVED)
        for name, before in (("positions", p.positions), ("velocities", 0.0))
        if name in answers
    ]
    return float(max(gaps)) if gaps and np.isfinite(gaps).all() else np.inf


def coordinate_gap(p: SpringProblem, name: str, expected: Any, output: Any) -> float:
    """Return the largest difference of a coordinate, the velocities of pins left out."""
    gap = np.abs(np.asarray(expected) - np.asarray(output))
    if name == "velocities":
        gap[..., p.pinned, :] = 0.0
    return float(gap.max(initial=0.0))


@dataclass(frozen=True, eq=False)
class StepContext:
    """An answer to a step, and the facts that its laws need."""

    problem: SpringProblem
    answers: Mapping[str, Any]  # by the names of the outputs
    allowed: Rounding
    model: StepModel  # the step that is declared, completed by what was inferred
    recognised: bool  # whether that model is declared or was recognised
    description: Sentence  # the model in words
    expected: Mapping[str, Any]  # its prediction, or {} if it has none
    step: Step  # as the greeting declares it

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
        x = self.answers["positions"]
        if np.abs(x).max(initial=0.0) > LARGEST:
            return None
        return judge_step(system_of(p), state_of(p), p.h, x, external_forces=external)

    @property
    def method_declared(self) -> bool:
        """Whether the greeting declares a method that need not converge."""
        step = self.step
        is_counted = step.method in ITERATIVE and step.iterations is not None
        is_divided = step.method is not None and step.substeps not in (None, 1)
        return (
            is_counted or is_divided or step.method in ("linearised", "position_based", *EXPLICIT)
        )

    @property
    def displacement(self) -> float:
        """By how much positions are expected to change, at most [m]."""
        return float(np.abs(self.expected["positions"] - self.problem.positions).max(initial=0.0))


def _graded(error: float, size: float, allowed: float) -> Verdict:
    """Return the verdict on a relative error that is not right, for a size with its rounding."""
    gap = error * (size + allowed / SOLVED)
    return Verdict.RIGHT_EXCEPT if gap <= IMPRECISE * size + ROUNDED * allowed else Verdict.WRONG


def not_finite(case: Case, name: str) -> Finding:
    """Return that outputs are not finite: merely wrong where a fault divides by a number of 0."""
    verdict = Verdict.WRONG if case.family == "zero" else None
    return finding("finite numbers", name=name, verdict=verdict)


def pins(context: StepContext) -> Finding | None:
    """Return how far pins are from where they were."""
    p, x = context.problem, context.answers.get("positions")
    if len(p.pinned) == 0 or x is None:
        return None
    offsets = np.linalg.norm(x - p.positions, axis=-1)[..., p.pinned].reshape(-1, len(p.pinned))
    worst, strict = float(offsets.max()), context.allowed.positions
    tolerance = strict + IMPRECISE * float(np.abs(x - p.positions).max())
    motion = 0.0
    if context.expected:
        expected = (context.expected["positions"] - p.positions)[..., p.pinned, :]
        motion = 2.0 * float(np.abs(expected).max())
        largest = np.inf if context.step.pins else HELD * float(np.abs(x - p.positions).max())
        tolerance += min(motion, largest)
    if context.step.pins in ("penalty", "heavy"):
        strict += motion
    is_exact = context.model.holds_pins and context.step.pins not in (None, "heavy")
    verdict = Verdict.RIGHT_EXCEPT if worst <= tolerance and not is_exact else Verdict.WRONG
    index = int(p.pinned[offsets.max(axis=0).argmax()])
    return finding("pins", worst, strict, verdict=verdict, index=index)


def declared_step(context: StepContext) -> Finding | None:
    """Return how far positions are from the declared or recognised step."""
    p = context.problem
    if "positions" not in context.answers:
        return None
    if not context.recognised:
        return finding("declared step, unknown", tolerance=SOLVED)
    if not context.expected or not np.isfinite(context.expected["positions"]).all():
        return finding("declared step, not finite", tolerance=SOLVED)
    answers = {"positions": context.answers["positions"]}
    error = relative_gap(p, context.expected, answers, context.allowed)
    gap = np.linalg.norm(context.expected["positions"] - answers["positions"], axis=-1)
    verdict = _graded(error, context.displacement, context.allowed.positions)
    if verdict is Verdict.WRONG and not p.steps:
        verdict = _excused(context)
    return finding(
        "declared step", error, SOLVED, verdict=verdict,
        index=int(gap.reshape(-1, p.count).max(axis=0).argmax()),
        gap=float(gap.max()), model=context.description,
    )  # fmt: skip


def _excused(context: StepContext) -> Verdict:
    """Return whether a step that differs is another minimum, or rests on a safeguard."""
    model, judgement = context.model, None
    if context.allowed.positions > context.displacement:
        return Verdict.UNDECIDED
    if model.integrator.method == "newton" and is_indefinite(context.problem):
        return Verdict.UNDECIDED
    if model.integrator.method == "converged" and (model.substeps, model.scaling) == (1, Scaling()):
        judgement = context.judgement
    if judgement is None or not judgement.reference_certificate.covered:
        return Verdict.WRONG
    is_near = judgement.distance <= IMPRECISE * judgement.displacement
    return Verdict.RIGHT if is_near else Verdict.WRONG


def is_indefinite(p: SpringProblem) -> bool:
    """Return whether Newton's method may meet a Hessian that no two programs correct alike."""
    length, _ = frames(p, p.positions)
    softening = p.stiffnesses * np.maximum(p.rest_lengths / length - 1.0, 0.0) * p.h**2
    return bool((np.abs(p.incidence).T @ softening > 0.1 * p.masses).any())


def minimiser(context: StepContext) -> Finding | None:
    """Return how far positions are from the nearest minimiser, relative to how far y is."""
    p = context.problem
    is_meant = "positions" in context.answers and not context.method_declared
    judgement = context.judgement if is_meant else None
    if judgement is None or not judgement.outcome.solved:
        return None
    rounded = judgement.distance <= context.allowed.positions * np.sqrt(3.0 * p.count)
    return finding(
        "minimiser" if context.recognised else "minimiser, of an unknown step",
        judgement.error, SOLVED,
        verdict=Verdict.RIGHT if rounded else None, distance=judgement.distance,
    )  # fmt: skip


def velocities(context: StepContext) -> Finding | None:
    """Return how far velocities are from the declared step's."""
    if "velocities" not in context.answers or not context.recognised or not context.expected:
        return None
    expected, model = context.expected["velocities"], context.model
    p, x, at_end = context.problem, context.answers.get("positions"), model.scaling.place == "end"
    by_displacement = model.velocity == "displacement" and not model.integrator.explicit
    if by_displacement and model.substeps == 1 and x is not None and not p.steps:
        expected = (x - p.positions) / p.h * (model.scaling.factor if at_end else 1.0)
    gap = coordinate_gap(p, "velocities", expected, context.answers["velocities"])
    size = float(np.abs(expected).max(initial=0.0))
    error = gap / (size + context.allowed.velocities / SOLVED)
    verdict = _graded(error, size, context.allowed.velocities)
    if not np.isfinite(gap):
        verdict = Verdict.UNDECIDED
    return finding("velocities", error, SOLVED, verdict=verdict, gap=gap)


def velocity_loss(context: StepContext) -> Finding | None:
    """Return the share of its speed that an undeclared factor takes from a particle in 1 s."""
    factor = context.model.scaling.factor
    if factor == 1.0 or context.step.damper == "global_factor" or not context.recognised:
        return None
    loss = 1.0 - factor ** (context.model.substeps / context.problem.h)
    return finding("velocity loss", loss, factor=factor)


def pin_velocities(context: StepContext) -> Finding | None:
    """Return how fast pins are that do not move."""
    p, v = context.problem, context.answers.get("velocities")
    if v is None or len(p.pinned) == 0 or not context.model.holds_pins:
        return None
    speeds = np.linalg.norm(v, axis=-1)[..., p.pinned].reshape(-1, len(p.pinned)).max(axis=0)
    if not np.isfinite(speeds).all():
        return None
    index = int(p.pinned[speeds.argmax()])
    return finding("pin velocities", speeds.max(), context.allowed.velocities, index=index)


def momentum(context: StepContext) -> Finding | None:
    """Return how far the centre of mass is from where gravity takes it, without pins."""
    p, x, model = context.problem, context.answers.get("positions"), context.model
    method = model.integrator.method
    if x is None or len(p.pinned) or p.steps or model.scaling.factor != 1.0:
        return None
    fall = p.h**2 * (p.constant.sum(0) / p.masses.sum())
    drift = p.shares @ (x - p.positions - p.h * p.velocities)
    size = float(fall @ fall)
    part = float(np.clip(drift @ fall / size, 0.0, 1.0)) if size else 0.0
    gap = float(np.linalg.norm(drift - part * fall))
    unbalanced = UNBALANCED if method == "converged" else SOLVED
    tolerance = 4.0 * context.allowed.positions + unbalanced * float(np.abs(x - p.positions).max())
    return finding("momentum", gap, tolerance)


def keeps_declaration(context: StepContext) -> bool:
    """Return whether an answer is that of the declared method and damper."""
    is_declared = context.method_declared and context.step.damper is not None
    findings = declared_step(context), velocities(context)
    return is_declared and all(not entry or not entry.verdict for entry in findings)


def consistency(context: StepContext) -> Finding | None:
    """Return how far the mean acceleration of a small step is from f / m."""
    p, v = context.problem, context.answers.get("velocities")
    if v is None or context.model.damper == "none" or context.model.scaling.factor != 1.0:
        return None  # without velocities explicit and implicit steps part at the first order
    expected = accelerations(p, p.positions, p.velocities)
    free = np.setdiff1d(np.arange(p.count), p.pinned)
    gap = float(np.abs((v - p.velocities) / p.h - expected)[free].max())
    scale = float(np.abs(expected[free]).max())
    tolerance = CONSISTENT * scale + 2.0 * context.allowed.velocities / p.h
    return finding("consistency", gap, tolerance, scale=scale)


def symmetry(
    exchange: Exchange, exchanges: Sequence[Exchange], allowed: Mapping[str, float]
) -> Finding | None:
    """Return how far the answer is from the transformed answer to the untransformed case."""
    facts, answer = exchange.case.facts, exchange.answer
    base = next((other.answer for other in exchanges if other.case.name == facts.get("of")), None)
    if not isinstance(base, Answer) or not isinstance(answer, Answer):
        return None
    worst, index, worst_name = 0.0, None, ""
    for name in [name for name in allowed if name in answer.values and name in base.values]:
        shift = facts["shift"] if name == "positions" else 0.0
        expected = base.values[name] @ facts["matrix"].T + shift
        expected = expected[..., np.argsort(facts["order"]), :]
        gap = np.linalg.norm(answer.values[name] - expected, axis=-1)
        gap = gap.reshape(-1, gap.shape[-1]).max(axis=0)
        ratio = float(gap.max()) / allowed[name]
        if not ratio <= worst:
            worst, index, worst_name = ratio, int(gap.argmax()), name
    return finding("symmetry", worst, 1.0, index=index, name=worst_name)
