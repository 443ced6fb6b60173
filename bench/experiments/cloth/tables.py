"""How the solvers of an implicit Euler step converge, dampers, and what is proven of a step."""

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    SOLVER,
    folded,
    least,
    lengths_of_steps,
    number,
    places,
    text,
    words_in,
)
from ...tables.layout import Layout
from ...tables.results import counted, listed, settings
from ...tables.table import INTERVAL, Column, Summary, words
from ..cloth_peers import DECADES, SOLVED, TARGETS
from ..pictures import figures as pictures
from . import figures, readings
from .problem import FRAME, FRAMES, GRAVITY
from .readings import LISTED, Convergence, DampedStep


def _after(quantity: str, count: int) -> Column:
    title, best = f"{quantity} after {words(count)}", "least" if quantity == "error" else ""
    read = partial(Convergence.after, quantity=quantity, count=count)
    return Column(title, read=read, best=best, group=f"{quantity} after")


def _iterations_to(decade: str) -> Column:
    read = partial(Convergence.needed, decade=decade)
    return Column(f"iterations to {decade}", read=read, best="least", group="iterations to")


def _consecutive(count: int) -> list[Column]:
    """Return the columns of consecutive steps of so many iterations each."""
    group = f"steps of {counted(count, 'iteration')}"

    def column(title: str, name: str, unit: str = "") -> Column:
        def read(row: Convergence) -> float | None:
            return getattr(row.few.get(count), name, None)

        return Column(f"{group}, {title}", unit, read=read, group=group)

    return [
        column("median error", "median_error"),
        column("largest error", "largest_error"),
        column("drift", "drift", "m"),
        column("drift, share of the path", "drift_share", "%"),
    ]


def _converged(name: str) -> list[Column]:
    return places(f"their {name}", "", (MEDIAN, LARGEST), lambda row: row.spread(name))


def _convergence_summary(rows: Sequence[Convergence]) -> Summary:
    points = (*_counts(rows), *_one_iteration(rows), *_newton(rows))
    return Summary(f"Iterations until the error of one step is {SOLVED}:", points)


def _counts(rows: Sequence[Convergence]) -> Iterable[str]:
    for cloth in dict.fromkeys(row.cloth for row in rows):
        counts = [_count(row) for row in rows if row.cloth == cloth and row.trial[0]]
        yield f"{cloth}: {listed(counts)}"


def _count(row: Convergence) -> str:
    count = row.needed(SOLVED)
    return (
        f"{row.solver} {words(count) if count is not None else f'more than {words(row.trial[0])}'}"
    )


def _one_iteration(rows: Sequence[Convergence]) -> Iterable[str]:
    for row in rows:
        if steps := row.few.get(1):
            yield (
                f"{row.cloth}, {settings([steps.record], 'steps')} steps of one local/global "
                f"iteration each: {words_in(steps.median_error, '%')} of the distance to the "
                f"converged step are left in the median; the cloth drifts by {words(steps.drift)} "
                f"m, {words_in(steps.drift_share, '%')} of its path"
            )


def _newton(rows: Sequence[Convergence]) -> Iterable[str]:
    shares = [row.hits for row in rows if row.hits]
    if shares:
        runs = [row for row in rows if row.hits]
        iterations, residual = (
            max(row.spread(name)[2] or 0 for row in runs) for name in ("iterations", "residual")
        )
        yield (
            f"Newton converged in {words(sum(share.hits for share in shares))} of "
            f"{words(sum(share.total for share in shares))} consecutive steps, with at most "
            f"{counted(int(iterations), 'iteration')} and a residual of at most {words(residual)}"
        )


def _how_converged(rows: Sequence[Convergence]) -> str:
    one_step = [row.one_step for row in rows if row.one_step]
    consecutive = [row.converged for row in rows if row.converged]
    consecutive += [steps.record for row in rows for steps in row.few.values()]
    sentences = [
        f"The lab’s cloth is let go from rest; one step is step {settings(one_step, 'step')} of "
        f"its motion. Steps of {lengths_of_steps(one_step)} ms."
    ] * bool(one_step)
    sentences += [
        f"Consecutive steps: {settings(consecutive, 'steps')} after the first "
        f"{settings(consecutive, 'first')}."
    ] * bool(consecutive)
    exact = "x* to 25 digits: Newton’s answer, refined in decimal arithmetic."
    return " ".join([*sentences, exact])


convergence = Layout(
    "How fast do solvers converge, and what does one solve of Q x = b leave?",
    "cloth_convergence",
    "Convergence of implicit Euler steps",
    subjects=readings.convergence,
    columns=(
        text("cloth", lambda row: row.cloth),
        text("solver", lambda row: row.solver),
        *(_after("error", count) for count in LISTED[:3]),
        *map(_iterations_to, TARGETS),
        *least([Column("least error", read=lambda row: row.trial[1])]),
        *folded(
            [
                *(_after("error", count) for count in LISTED[3:]),
                *(_iterations_to(decade) for decade in DECADES if decade not in TARGETS),
                Column("iterations tried", read=lambda row: row.trial[0]),
                *(_after("residual", count) for count in LISTED),
                *(column for count in LISTED[:3] for column in _consecutive(count)),
                Column("converged steps", note=INTERVAL, read=lambda row: row.hits),
                *places(
                    "their iterations", "", (MEDIAN, LARGEST), lambda row: row.spread("iterations")
                ),
                *places(
                    "their residual", "", (MEDIAN, LARGEST), lambda row: row.spread("residual")
                ),
                Column("steps at the rounding floor", read=lambda row: row.at_floor),
            ]
        ),
    ),
    shows="The error is |x − x*| / |y − x*|: what is left of the distance between the inertial "
    "start y and the converged step x*. Where it stands still it is at the floor: to round x* to "
    "float64 leaves as much. Each consecutive step begins at a state of the converged motion; "
    "drift is how far the cloth is from the converged one in the end if all steps make so few "
    "iterations, the path how far that one has moved. The residual is |grad g(x)| over its value "
    "at y, or over what only rounding leaves where that is more.",
    measured=_how_converged,
    summary=_convergence_summary,
    figures=(figures.cloth_convergence, pictures.falling_cloth),
)


def _damper_summary(steps: Sequence[DampedStep]) -> Summary:
    cloths: dict[str, list[DampedStep]] = {}
    for step in steps:
        cloths.setdefault(step.record.title, []).append(step)
    return Summary(
        "The forces of the two laws differ, relatively, by:",
        tuple(f"{title}: {_at(of[0])}, {_at(of[-1])}" for title, of in cloths.items()),
    )


def _at(step: DampedStep) -> str:
    return f"{words(step.difference)} at {words_in(step.h, 'ms')}"


dampers = Layout(
    "How far apart are the two laws of dampers?",
    "cloth_dampers",
    "Two laws of dampers at the end of one step",
    subjects=readings.damped_steps,
    columns=(
        text("cloth", lambda step: step.record.title),
        Column("h", "ms", read=lambda step: step.h),
        Column("difference", read=lambda step: step.difference),
        Column("observed order", read=lambda step: step.order),
    ),
    shows="A step’s damper has an energy and pulls with −(c/h)(l − l_n) u; an explicit "
    "integrator’s pulls with −c ((v_i − v_j)·u) u. The difference of all forces over those of "
    "the second law, where both are at home: at the end of the step, with its velocities. It "
    "comes from the springs’ rotation within the step and shrinks with h, to first order.",
    measured=lambda steps: (
        "The lab’s cloth with a damping of "
        f"{settings((step.record for step in steps), 'damping')} N s/m after "
        f"{settings((step.record for step in steps), 'first')} steps of its swing; one converged "
        "step of each length from there."
    ),
    summary=_damper_summary,
)


def _proof_summary(records: Sequence[Record]) -> Summary:
    newton = [record for record in records if record.solver == "newton"]
    others = [record for record in records if record.solver != "newton"]
    same = [float(record.values.apart) for record in others if record.values.same]
    return Summary(
        "Newton reached the tolerance or the rounding floor in "
        f"{words(sum(map(readings.is_solved, newton)))} of {counted(len(newton), 'cloth')}. Of the "
        f"other solvers’ {counted(len(others), 'answer')}, {words(len(same))} are proven to belong "
        "to the same minimiser, at most "
        f"{words(metrics.spread(np.array(same)).largest)} m from Newton’s."
    )


def _sizes(records: Sequence[Record]) -> str:
    sizes = sorted({int(record.values.size) for record in records})
    return listed([f"{size} × {size}" for size in sizes], "or")


proofs = Layout(
    "Which answers to a hard step are proven?",
    "cloth_proofs",
    "One step of a cloth in mid-swing: which answers are proven",
    subjects=lambda results: results.all("newton"),
    columns=(
        Column("stiffness", "N/m", read=lambda record: record.details.stiffness),
        SOLVER,
        text("from", lambda record: record.details.start),
        number("iterations"),
        *least([number("residual")]),
        Column("a minimiser within", "m", read=readings.minimiser_distance, best="least"),
        text("Newton’s minimiser", readings.shares_minimiser),
        *folded(
            [
                number("residual in MuJoCo’s forces", "balance"),
                text("bound", readings.bound),
                number("to Newton’s answer", "apart", "m"),
                number("error"),
                number("g above Newton’s", "above", "kg m²"),
            ]
        ),
    ),
    shows="Within the distance there is a minimiser of g, and only one: proven, with all "
    "rounding allowed for, from the Newton step, the least eigenvalue of the Hessian and how "
    "fast the Hessian may change. Where there is no bound the column says why, and error and g "
    "are all there is. The error is |x − x*| / |y − x*|; x* is Newton’s answer to 25 digits.",
    measured=lambda records: (
        f"The lab’s cloth of {_sizes(records)} particles under {GRAVITY:g} m/s², "
        f"{FRAMES * FRAME:g} s after it was let go; one step of {settings(records, 'h')} s, "
        f"to a residual of {settings(records, 'tolerance')}, the rounding floor, or the solver’s "
        "last iteration."
    ),
    summary=_proof_summary,
)


LAYOUTS = (convergence, dampers, proofs)
