"""Position-based steps: free flight, then projections that bring springs nearer to their lengths.

They are Verlet with sweeps of constraints (Jakobsen 2001), position-based dynamics (Müller et al.
2007; PBD) and its extended form (Macklin et al. 2016; XPBD). Answers depend on the order of
springs, compliances and the number of sweeps, so none are predicted: laws that need no model judge
them. With s the end of free flight, u a spring's direction and x' the answer, a single spring moves
its ends along u, and leaves a share between 0 and 1 of l(s) - r.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..exchange import Answer, Exchange
from ..greeting import Step
from ..judgement import Finding, Verdict
from ..laws import finding
from . import laws
from .laws import SOLVED, StepContext, coordinate_gap
from .measured import SteppedAnswer, measured
from .model import Integrator, Scaling, StepModel, predicted
from .problem import SpringProblem, frames

METHOD, DECLARATION = "position_based", '"step": {"method": "position_based"}'
# The least number of cases of one spring that show a share without regard to stiffness and mass.
LEAST_CASES = 3
# A share of the deviation from the rest length that counts as no projection at all.
UNCHANGED = 0.999
# Powers of h: 0 of rigid constraints, 2 of compliances, each known to this; a small step has terms
# of the next order, some hundredths.
POWER = 0.1
# The sign of a pull shows through substeps if the deviation from the rest length changes by less
# than this factor, and the spring swings by less than this angle [rad].
STEADY, SWING = 2.0, 1.0
# Springs that disagree pass deviations on to each other; the sum grows by less than this factor.
CONFLICT = 2.0


def flight_model(step: Step, answers: Sequence[SteppedAnswer]) -> StepModel:
    """Return the free flight of a position-based step: x' = x + h (v + h g), in each substep.

    Without a declaration, the centre of mass tells substeps and a factor.
    """
    numbers = measured(answers, step.substeps)
    count = step.substeps or next(iter(numbers.get("substeps", [])), 1)
    factor = step.damping_factor or next(iter(numbers.get("factor", [])), 1.0)
    models = [
        StepModel(Integrator("symplectic"), count, "none", Scaling(factor, place), "overwritten")
        for place in ("end", "start", "middle")
    ]
    return min(models, key=lambda model: _drift(model, answers))


def _drift(model: StepModel, answers: Sequence[SteppedAnswer]) -> float:
    """Return how far the centre of mass is from a model's, over all answers without pins."""
    gaps = [
        np.abs(p.shares @ (flight(p, model)[name] - outputs[name])).max()
        for p, outputs in answers
        for name in outputs
        if not p.pinned.size
    ]
    return float(np.sum(gaps))


def flight(p: SpringProblem, model: StepModel) -> dict[str, FloatArray]:
    """Return the end of a step without springs."""
    zeros = np.zeros_like(p.stiffnesses)
    return predicted(p.changed(stiffnesses=zeros, dampings=zeros), model)


def is_shown(answers: Sequence[SteppedAnswer]) -> bool:
    """Return whether single springs are projected without regard to their stiffness and masses.

    A step by forces leaves a share of 1 / (1 + h² k / m), which differs from case to case.
    """
    model = flight_model(Step(), answers)
    shares, stiffnesses = list[float](), set[float]()
    for p, outputs in answers:
        if len(p.springs) != 1 or p.steps or "positions" not in outputs:
            continue
        across, share, deviation = _projection(
            p, flight(p, model)["positions"], outputs["positions"]
        )
        if abs(deviation) > SOLVED:
            shares.append(share if across <= SOLVED * abs(deviation) else np.inf)
            stiffnesses.add(round(_stiffness(p), 9))
    is_common = len(shares) >= LEAST_CASES and np.allclose(shares, shares[0], 0.0, SOLVED)
    return bool(is_common and len(stiffnesses) > 1 and -SOLVED <= min(shares) < UNCHANGED)


def _stiffness(p: SpringProblem) -> float:
    """Return h² k / m of a single spring, m its reduced mass."""
    inverses = 1.0 / p.masses
    inverses[p.pinned] = 0.0
    return float(p.h**2 * p.stiffnesses[0] * inverses.sum())


def _projection(p: SpringProblem, free: FloatArray, x: FloatArray) -> tuple[float, float, float]:
    """Return of a single spring how far its ends moved across it, the share left, and l(s) - r."""
    length, u = frames(p, free)
    moves = x - free
    across = np.linalg.norm(moves - (moves @ u[0])[:, None] * u[0], axis=1).max()
    deviation = float(length[0] - p.rest_lengths[0])
    end = float(u[0] @ (p.incidence[0] @ x)) - float(p.rest_lengths[0])
    return float(across), end / deviation if deviation else 0.0, deviation


def free_fall(context: StepContext) -> Finding | None:
    """Return how far the centre of mass is from that of free flight, without pins."""
    p, expected, answers = context.problem, context.expected, context.answers
    if p.pinned.size or "positions" not in answers:
        return None
    gaps = {
        name: float(np.linalg.norm(p.shares @ (answers[name] - expected[name]), axis=-1).max())
        for name in answers
    }
    gap = max(gaps["positions"], p.h / context.model.substeps * gaps.get("velocities", 0.0))
    return finding("momentum", gap, _allowed(context))


def _allowed(context: StepContext) -> float:
    """Return what rounding and an iterative solver may leave of positions [m]."""
    moved = np.abs(context.answers["positions"] - context.problem.positions).max()
    return 4.0 * context.allowed.positions + SOLVED * float(moved)


def velocities(context: StepContext) -> Finding | None:
    """Return how far velocities are from (x' - x) / h, times a factor at the end."""
    p, x, v = context.problem, context.answers.get("positions"), context.answers.get("velocities")
    if x is None or v is None or context.model.substeps > 1:
        return None
    before = np.concatenate([p.positions[None], x.reshape(-1, p.count, 3)])
    factor, place = context.model.scaling
    expected = np.diff(before, axis=0).reshape(x.shape) / p.h * (factor if place == "end" else 1.0)
    gap, size = coordinate_gap(p, "velocities", expected, v), float(np.abs(expected).max())
    return finding("velocities", gap, context.allowed.velocities + SOLVED * size, gap=gap)


def projections(context: StepContext) -> Finding | None:
    """Return whether springs come nearer to their rest lengths than they do in free flight."""
    p, x = context.problem, context.answers.get("positions")
    if x is None or p.steps:
        return None
    free = context.expected["positions"]
    if len(p.springs) == 1:
        return (
            _single(context, free, x) if context.model.substeps == 1 else _planar(context, free, x)
        )
    stretched = (p.stiffnesses > 0.0) & ~(p.tension_only & (frames(p, free)[0] < p.rest_lengths))
    before, after = (
        float(np.linalg.norm((frames(p, ends)[0] - p.rest_lengths)[stretched]))
        for ends in (free, x)
    )
    if context.model.substeps > 1 or not p.stiffnesses.all():
        return None
    return finding("projections", after, CONFLICT * before + _allowed(context), before=before)


def _single(context: StepContext, free: FloatArray, x: FloatArray) -> Finding | None:
    """Judge the projection of a single spring."""
    p, allowed = context.problem, _allowed(context)
    across, share, deviation = _projection(p, free, x)
    if across > allowed:
        return finding("projection", across, allowed)
    if abs(deviation) <= 30.0 * allowed or p.tension_only.any():
        return finding("projection", float(np.abs(x - free).max()), 31.0 * allowed)
    excess = max(-share, share - (1.0 if not p.stiff else UNCHANGED)) * abs(deviation)
    return finding("projection", excess, allowed)


def _planar(context: StepContext, free: FloatArray, x: FloatArray) -> Finding | None:
    """Judge the substeps of a single free spring, which stays in the plane of its motion."""
    p, allowed = context.problem, _allowed(context)
    if p.pinned.size:
        return None
    d, d_free, d_end = (p.incidence[0] @ ends for ends in (p.positions, free, x))
    normal = np.cross(d, d_free)
    size = float(np.linalg.norm(normal))
    if size > SOLVED * float(d @ d) and abs(d_end @ normal) > allowed * size:
        return finding("projection", abs(d_end @ normal) / size, allowed)
    lengths = [float(np.linalg.norm(end)) for end in (d, d_free, d_end)]
    start, end = (length - float(p.rest_lengths[0]) for length in lengths[:2])
    is_steady = 1.0 / STEADY < (start / end if end else 0.0) < STEADY
    if not is_steady or _stiffness(p) > SWING**2:
        return None
    growth = (lengths[2] - lengths[1]) * np.sign(end)
    return finding("projection", growth, allowed)


LAWS: tuple[Callable[[StepContext], Finding | None], ...] = (
    laws.pins, free_fall, velocities, laws.velocity_loss, laws.pin_velocities, projections,
    laws.minimiser,
)  # fmt: skip


def findings(
    exchange: Exchange,
    exchanges: Sequence[Exchange],
    context: StepContext,
    allowed: Mapping[str, float],
) -> list[Finding]:
    """Return the findings of all laws that apply."""
    entries = [law(context) for law in LAWS]
    symmetry = laws.symmetry(exchange, exchanges, allowed)
    if symmetry is not None:
        facts = exchange.case.facts
        is_renumbered = (facts["order"] != np.arange(context.problem.count)).any()
        entries.append(numbering(symmetry, allowed, context) if is_renumbered else symmetry)
    entries.append(order(exchange, exchanges, context))
    return [entry for entry in entries if entry is not None]


def order(
    exchange: Exchange, exchanges: Sequence[Exchange], context: StepContext
) -> Finding | None:
    """Return how the displacement by springs changes where h is halved."""
    base = next((e for e in exchanges if e.case.name == exchange.case.facts.get("halves")), None)
    if base is None or not isinstance(base.answer, Answer) or "positions" not in context.answers:
        return None
    p = context.problem.changed(h=2.0 * context.problem.h)
    pairs = ((p, base.answer.values), (context.problem, context.answers))
    long, short = (
        float(np.linalg.norm(outputs["positions"] - flight(q, context.model)["positions"]))
        for q, outputs in pairs
    )
    if min(long, short) <= 100.0 * context.allowed.positions:
        return None
    power = float(np.log2(long / short))
    is_known = min(abs(power), abs(power - 2.0)) <= POWER
    verdict = Verdict.RIGHT_EXCEPT if power > -POWER else Verdict.WRONG
    return finding(
        "order in h", 0.0 if is_known else abs(power), POWER, verdict=verdict, power=power
    )


def numbering(symmetry: Finding, allowed: Mapping[str, float], context: StepContext) -> Finding:
    """Return a reservation where another numbering changes no more than the order of springs."""
    moves = np.abs(context.answers["positions"] - context.expected["positions"]).max()
    is_small = symmetry.error * allowed["positions"] <= float(moves)
    if symmetry.verdict is Verdict.RIGHT or not is_small:
        return symmetry
    return finding("symmetry, of the order", symmetry.error, 1.0)


def description(model: StepModel) -> Sentence:
    """Return the step in words."""
    return sentence("a position-based step (substeps: {count})", count=model.substeps)


def stiffness(answers: Sequence[SteppedAnswer], model: StepModel) -> Sentence | None:
    """Return what stiffness a single spring has in effect, from a step by which it is projected.

    A mass at rest falls by h² g, and the projection lifts it again: it leaves the share q of the
    deviation, so that m g hangs by q h² g / (1 - q), as on a spring of m (1 - q) / (q h²).
    """
    for p, outputs in answers:
        is_single = len(p.springs) == 1 and "positions" in outputs
        if not is_single or not p.stiff or p.steps or model.substeps > 1:
            continue
        free = flight(p, model)["positions"]
        _, share, _ = _projection(p, free, outputs["positions"])
        if not SOLVED < share < UNCHANGED:
            return sentence(
                "Its springs are rigid: a mass hangs at the rest length, not m g / k below."
            )
        ratio = share * _stiffness(p) / (1.0 - share)
        return sentence(
            "At h = {h:.3g} s a spring of {k:.4g} N/m acts as one of {effective:.4g} N/m: a mass "
            "at rest hangs {ratio:.3g} times m g / k below its rest length.",
            h=p.h,
            k=float(p.stiffnesses[0]),
            effective=float(p.stiffnesses[0]) / ratio,
            ratio=ratio,
        )
    return None
