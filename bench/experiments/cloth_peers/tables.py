"""One cloth for every solver: work against precision, motions, limits of stability."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ...harness.record import Record
from ...problems.falling_cloth import FALLING, FRAME, GRAVITY, MASS, SIDE
from ...tables.columns import SOLVER, folded, greatest, least, number, text, words_in
from ...tables.layout import Layout, source
from ...tables.results import Results, label, listed
from ...tables.table import Column, Summary, Table, words
from ..published import problem as published
from . import MISSING, TARGETS, figures, readings
from .measurement import AMPLITUDE, BISECTION, GROWTH, REPEATS, STABILITY_SIZE, STABILITY_STEPS
from .readings import NEAR, Motion, Point, Steps, grouped

_CLOTH = (
    f"A cloth of the lab’s springs without dampers, {SIDE:g} m a side and {MASS:g} kg whatever its "
    f"particles, under {GRAVITY:g} m/s², held at two corners, {FALLING * FRAME:g} s after it was "
    f"let go; frames of {words_in(FRAME, 'ms')}. "
)
_FAIR = (
    "Every solver works in a process of its own on one core and is timed frame by frame, without "
    "set-up and conversions. Newton the engine computes in single precision, all others in double. "
)
_TRUTH = (
    "Converged implicit Euler is our Newton in steps of a frame, at the rounding floor, and x* its "
    "first step to 25 digits, in decimal arithmetic. The truth is the classical Runge-Kutta method "
    "far below its limit of stability"
)


@dataclass(frozen=True, eq=False)
class WithMissing(Layout):
    """A layout whose tables end with a row for each engine that is missing."""

    def __call__(self, results: Results) -> Table:
        """Return the table with a row for each subject and for each engine that is missing."""
        table = super().__call__(results)
        missing = results.all("cloth", task=MISSING)
        texts = [{"cloth": "every cloth", "solver": r.solver, **r.notes} for r in missing]
        rows = [tuple(row.get(column.title) for column in table.columns) for row in texts]
        sources = (*table.sources, *map(source, missing))
        return replace(table, rows=(*table.rows, *rows), sources=sources)


def _time_to(target: str) -> Column:
    def read(row: Steps) -> float | None:
        point = row.cheapest(target)
        return point and point.seconds

    return Column(f"time to {target}", "ms", read=read, best="least")


def _setting_to(target: str) -> Column:
    def read(row: Steps) -> str | None:
        point = row.cheapest(target)
        return point and point.rung

    return text(f"{target} by", read)


def _step_summary(rows: Sequence[Steps]) -> Summary:
    points = (
        f"{cloth}: {listed([f'to {target} {_fastest(of, target)}' for target in TARGETS])}"
        for cloth, of in grouped(rows, lambda row: row.first.cloth).items()
    )
    return Summary("The fastest of all solvers in one step:", tuple(points))


def _fastest(rows: Sequence[Steps], target: str) -> str:
    names = [f"{p.solver}, {words_in(p.seconds, 'ms')}" for p in readings.fastest(rows, target)]
    return " (then ".join(names) + ")" * (len(names) > 1) if names else "none"


one_step = WithMissing(
    "Which of all solvers is soonest near the converged step?",
    "cloth_peers_step",
    "One step of a falling cloth by every solver",
    subjects=readings.steps,
    columns=(
        text("cloth", lambda row: row.first.cloth),
        text("solver", lambda row: row.first.solver),
        *map(_time_to, TARGETS),
        *least([Column("least error", read=lambda row: row.least_error)]),
        text("remark", lambda row: row.first.remark),
        *folded([*map(_setting_to, TARGETS), text("least by", lambda row: row.best.rung)]),
    ),
    shows="The error is |x − x*| / |y − x*|, what is left of the distance between the inertial "
    "start y and the converged step x*. Explicit solvers and those that solve one linear "
    "system do another step: their error stays, however long they take.",
    measured=f"{_CLOTH}{_FAIR}{_TRUTH}. Times are medians of up to {REPEATS}; settings are those "
    "of a ladder, of which the cheapest that suffices counts.",
    summary=_step_summary,
    figures=(figures.one_step,),
)


def _motion_summary(rows: Sequence[Motion]) -> Summary:
    lost = dict.fromkeys(row.point.solver for row in rows if row.point.values["diverged"])
    whole = grouped([row.point for row in rows if row.point.is_whole], lambda point: point.cloth)
    sentence = f"With some settings diverged: {listed(list(lost))}." if lost else "None diverged."
    points = [f"{cloth}: {_nearest(of)}" for cloth, of in whole.items()]
    return Summary(f"{sentence} Nearest to the truth:", (*points, *_stable(rows)))


def _nearest(whole: Sequence[Point]) -> str:
    best, fast = readings.nearest(whole)
    sentence = f"{best.solver} by {best.rung}, {words(best.values['true'])} m"
    if fast is None:
        return sentence
    return (
        f"{sentence}; the fastest within {words(NEAR)} m {fast.solver} by {fast.rung}, "
        f"{words_in(fast.seconds, 'ms')} a frame"
    )


def _stable(rows: Sequence[Motion]) -> Iterable[str]:
    shares = {row.point.solver: row.limit.share for row in rows if row.limit and row.limit.step}
    if shares:
        names = [f"{solver} {words(share)}" for solver, share in shares.items()]
        yield f"longest stable step in units of 2 / ω: {listed(names)}"


def _how_moved(rows: Sequence[Motion]) -> str:
    unsure, low, high = readings.certainty(rows)
    return (
        f"{_CLOTH}{_FAIR}{_TRUTH}: halving its steps moves it by no more than {words(unsure)} m, "
        f"at an observed order of {words(low)} (where the stiffest modes are hardly resolved) to "
        f"{words(high)}. For stability a cloth of {STABILITY_SIZE} × {STABILITY_SIZE} particles "
        f"hangs at rest and is pushed by {words(AMPLITUDE)} m along its highest mode; a step is "
        f"stable if that has grown less than {GROWTH:g}-fold after {STABILITY_STEPS} steps. Its "
        f"limit is found by bisection to a relative error of {words(BISECTION)}."
    )


def _number(title: str, unit: str, name: str) -> Column:
    return Column(title, unit, read=lambda row: row.point.number(name))


motion = WithMissing(
    "And frame after frame, near implicit Euler and near the truth? How long may steps be?",
    "cloth_peers_motion",
    "A falling cloth by every solver, frame after frame",
    subjects=readings.motions,
    columns=(
        text("cloth", lambda row: row.point.cloth),
        text("solver", lambda row: row.point.solver),
        text("a frame by", lambda row: row.point.rung),
        *least(
            [
                _number("distance from implicit Euler", "m", "implicit"),
                _number("distance from the truth", "m", "true"),
            ]
        ),
        _number("time for a frame", "ms", "seconds"),
        *greatest([Column("stable up to", "2/ω", read=lambda row: row.limit and row.limit.share)]),
        text("remark", lambda row: row.remark),
        *folded(
            [
                Column("frames", read=lambda row: int(row.point.values["frames"])),
                Column("time for a simulated second", "s", read=lambda row: row.simulated_second),
                Column("longest stable step", "ms", read=lambda row: row.limit and row.limit.step),
                Column("2 / ω", "ms", read=lambda row: row.limit and row.limit.theory),
            ]
        ),
    ),
    ranked=lambda row: row.point.is_whole,
    shows="Distances are root mean squares over the particles after the last frame. Diverged "
    "means that a particle was farther from its true place than the cloth is wide. Symplectic "
    "Euler is stable up to h = 2 / ω, the classical Runge-Kutta method up to 2.828 / ω; ω² is the "
    "largest eigenvalue of M⁻¹ K of a small cloth of the same springs at rest.",
    measured=_how_moved,
    summary=_motion_summary,
    figures=(figures.to_implicit_euler, figures.to_the_truth),
)


def _vertices(records: Sequence[Record]) -> str:
    return words(int(records[0].values.vertices))


def _liu_summary(records: Sequence[Record]) -> Summary:
    points = (
        f"{label(record.solver)}, {published.LIU_2013[record.solver].done}: "
        f"{words_in(readings.median_time(record), 'ms')}, published "
        f"{words_in(published.LIU_2013[record.solver].seconds, 'ms')}; here an error of "
        f"{words(record.values.error)} is left"
        for record in records
    )
    return Summary(f"A frame of {_vertices(records)} vertices:", tuple(points))


liu_2013 = Layout(
    "What did Liu et al. (2013) measure, and what do we?",
    "cloth_liu_2013",
    "The times of Liu et al. (2013), and here",
    subjects=readings.as_published,
    columns=(
        SOLVER,
        text("a frame by", lambda record: published.LIU_2013[record.solver].done),
        Column("published", "ms", read=lambda record: published.LIU_2013[record.solver].seconds),
        Column("here", "ms", read=readings.median_time, best="least"),
        number("here, error left", "error"),
    ),
    shows="The error is |x − x*| / |y − x*| as above; 1 is no nearer than the inertial start y. "
    "What the paper’s ten iterations leave is not known to us.",
    measured=lambda records: (
        "Published: 6,561 vertices; read in the abstract and captions, so springs, "
        f"stiffness, step and machine are not known to us. Here: {_vertices(records)} particles, "
        f"{words(int(published.LIU_2013_STIFFNESS))} N/m, one step of "
        f"{words_in(published.LIU_2013_FRAME, 'ms')} from mid-fall, on one core; "
        f"Newton to a residual of {words(published.LIU_2013['newton'].settings['tolerance'])}."
    ),
    summary=_liu_summary,
    compared=0,
)


LAYOUTS = (one_step, motion, liu_2013)
