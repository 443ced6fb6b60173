"""One cloth for every solver: work against precision, iterations, limits of stability."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, label, listed
from ...peers import registry
from ...problems.falling_cloth import FALLING, FRAME, GRAVITY, MASS, SIDE
from ...tables.columns import SOLVER, folded, least, number, text, words_in
from ...tables.layout import Layout, source
from ...tables.table import Column, Summary, Table, listing, words
from ..published import problem as published
from . import DECADES, LIU, MISSING, MOTION, NEEDED, ONE_STEP, SOLVED, STABILITY, TARGETS, figures
from .measurement import AMPLITUDE, BISECTION, GROWTH, REPEATS, STABILITY_SIZE, STABILITY_STEPS
from .readings import Point, points

# So near to the truth [m] a motion is hard to tell from it by eye.
_NEAR = 1e-2
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


def _cloths(found: Sequence[Point]) -> dict[str, list[Point]]:
    """Return the points on each cloth."""
    cloths: dict[str, list[Point]] = {}
    for point in found:
        cloths.setdefault(point.cloth, []).append(point)
    return cloths


def _groups(found: Sequence[Point]) -> list[list[Point]]:
    """Return the points of each solver on each cloth, in order."""
    groups: dict[tuple[str, str], list[Point]] = {}
    for point in found:
        groups.setdefault((point.cloth, point.solver), []).append(point)
    return list(groups.values())


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


def _columns_to(target: str) -> tuple[Column, ...]:
    """Return what the cheapest setting takes to an error, and which it is."""

    def cheapest(group: Sequence[Point]) -> Point | None:
        return _reached(group, float(target))

    return (
        Column(
            f"time to {target}",
            "ms",
            read=lambda group: (point := cheapest(group)) and point.values["seconds"],
            best="least",
        ),
        replace(
            text(f"{target} by", lambda group: (point := cheapest(group)) and point.rung),
            folded=True,
        ),
    )


def _reached(group: Sequence[Point], target: float) -> Point | None:
    seconds, errors = (np.array([p.values[name] for p in group]) for name in ("seconds", "error"))
    i = metrics.cheapest_within(seconds, errors, target)
    return None if i is None else group[i]


def _best(group: Sequence[Point]) -> Point:
    return min(group, key=lambda point: point.values["error"])


def _least_error(group: Sequence[Point]) -> float | str:
    error = _best(group).values["error"]
    return "diverged" if np.isinf(error) else error


def _remark(group: Sequence[Point]) -> str:
    """Return what a record says of this cloth."""
    record = group[0].record
    remarks = zip(record.arrays["remark_particles"], record.facts["remarks"], strict=True)
    return "; ".join(sentence for particles, sentence in remarks if particles == group[0].particles)


def _seconds(point: Point) -> float:
    return point.values["seconds"]


def _step_summary(groups: Sequence[Sequence[Point]]) -> Summary:
    cloths: dict[str, list[Sequence[Point]]] = {}
    for group in groups:
        cloths.setdefault(group[0].cloth, []).append(group)
    return Summary(
        "The fastest of all solvers in one step:",
        tuple(
            f"{cloth}: {listed([f'to {name} {_fastest(of, float(name))}' for name in TARGETS])}"
            for cloth, of in cloths.items()
        ),
    )


def _engine(point: Point) -> str:
    return registry.find(point.solver).engine


def _fastest(groups: Sequence[Sequence[Point]], target: float) -> str:
    reached = [point for group in groups if (point := _reached(group, target)) is not None]
    if not reached:
        return "none"
    best = min(reached, key=_seconds)
    after = min((p for p in reached if _engine(p) != _engine(best)), key=_seconds, default=None)
    beside = "" if after is None else f" (then {_with_time(after)})"
    return f"{_with_time(best)}{beside}"


def _with_time(point: Point) -> str:
    return f"{point.solver}, {words_in(_seconds(point), 'ms')}"


one_step = WithMissing(
    "Which of all solvers is soonest near the converged step?",
    "cloth_peers_step",
    "One step of a falling cloth by every solver",
    columns=(
        text("cloth", lambda group: group[0].cloth),
        text("solver", lambda group: group[0].solver),
        *(column for target in TARGETS for column in _columns_to(target)),
        Column("least error", read=_least_error, best="least"),
        replace(text("least by", lambda group: _best(group).rung), folded=True),
        text("remark", _remark),
    ),
    subjects=lambda results: _groups(points(results, ONE_STEP)),
    shows="The error is |x − x*| / |y − x*|, what is left of the distance between the inertial "
    "start y and the converged step x*. Explicit solvers and those that solve one linear "
    "system do another step: their error stays, however long they take.",
    measured=f"{_CLOTH}{_FAIR}{_TRUTH}. Times are medians of up to {REPEATS}; settings are those "
    "of a ladder, of which the cheapest that suffices counts.",
    summary=_step_summary,
    figures=(figures.one_step,),
)


def _known(title: str, name: str, unit: str) -> Column:
    """Return the column of a value, empty where it is not a number."""
    return Column(title, unit, read=lambda point: _number_or_none(point.values[name]))


def _number_or_none(value: float) -> float | None:
    return None if np.isnan(value) else value


def _simulated_second(point: Point) -> float | None:
    frame = _number_or_none(_seconds(point))
    return None if frame is None else metrics.ratio(frame, point.record.settings["frame"])


def _fate(point: Point) -> str:
    if point.values["diverged"]:
        return "diverged"
    if point.is_whole:
        return ""
    return _remark([point]) or f"out of time before frame {int(point.values['frames']) + 1}"


def _certainty(found: Sequence[Point]) -> str:
    records = list({id(point.record): point.record for point in found}.values())
    if not records:
        return "–"
    unsure = max(float(record.arrays["unsure"].max()) for record in records)
    low, high = metrics.extent(np.concatenate([record.arrays["order"] for record in records]))
    return (
        f"halving its steps moves it by no more than {words(unsure)} m, at an observed order of "
        f"{words(low)} (where the stiffest modes are hardly resolved) to {words(high)}"
    )


def _motion_summary(found: Sequence[Point]) -> Summary:
    lost = dict.fromkeys(point.solver for point in found if point.values["diverged"])
    whole = _cloths([point for point in found if point.is_whole])
    sentence = f"With some settings diverged: {listed(list(lost))}." if lost else "None diverged."
    return Summary(
        f"{sentence} Nearest to the truth:",
        tuple(f"{cloth}: {_nearest(of)}" for cloth, of in whole.items()),
    )


def _nearest(whole: Sequence[Point]) -> str:
    best = min(whole, key=lambda point: point.values["true"])
    said = f"{best.solver} by {best.rung}, {words(best.values['true'])} m"
    close = [point for point in whole if point.values["true"] <= _NEAR]
    if not close:
        return said
    first = min(close, key=_seconds)
    return (
        f"{said}; the fastest within {words(_NEAR)} m {first.solver} by {first.rung}, "
        f"{words_in(_seconds(first), 'ms')} a frame"
    )


def _sizes(records: Sequence[Record]) -> str:
    size = records[0].settings["size"] if records else 0
    return f"{size} × {size}"


def _needed(record: Record, decade: str) -> int | None:
    needed = record.arrays["needed"][DECADES.index(decade)]
    return None if np.isnan(needed) else int(needed)


def _needed_summary(records: Sequence[Record]) -> Summary:
    said = []
    for stiffness in dict.fromkeys(record.settings["stiffness"] for record in records):
        mine = [record for record in records if record.settings["stiffness"] == stiffness]
        counts = [f"{label(r.solver)} {_count_to(r, SOLVED)}" for r in mine]
        said.append(f"{words(int(stiffness))} N/m: {listed(counts)}")
    return Summary(f"Iterations to an error of {SOLVED}:", tuple(said))


def _count_to(record: Record, decade: str) -> str:
    needed = _needed(record, decade)
    return f"more than {words(int(record.arrays['tried']))}" if needed is None else words(needed)


class Limit(NamedTuple):
    """The longest stable step of a solver on one cloth [s], and 2 / ω there."""

    record: Record
    stiffness: int
    step: float | None
    theory: float

    @property
    def share(self) -> float | None:
        """The step in units of 2 / ω."""
        return None if self.step is None else metrics.ratio(self.step, self.theory)


def _limits(record: Record) -> Iterator[Limit]:
    columns = (record.arrays[name] for name in ("stiffness", "limit", "frequency"))
    for stiffness, limit, frequency in zip(*columns, strict=True):
        theory = metrics.ratio(2.0, float(frequency))
        yield Limit(record, int(stiffness), _number_or_none(float(limit)), theory)


def _stability_summary(limits: Sequence[Limit]) -> Summary:
    shares = {limit.record.solver: limit.share for limit in limits if limit.step is not None}
    points = (f"{solver}: {words(share)} × 2 / ω" for solver, share in shares.items())
    return listing("The longest stable step:", points)


motion = WithMissing(
    "And frame after frame, near implicit Euler and near the truth?",
    "cloth_peers_motion",
    "A falling cloth by every solver, frame after frame",
    columns=(
        text("cloth", lambda point: point.cloth),
        text("solver", lambda point: point.solver),
        text("a frame by", lambda point: point.rung),
        Column("frames", read=lambda point: int(point.values["frames"]), folded=True),
        *least(
            [
                _known("distance from implicit Euler", "implicit", "m"),
                _known("distance from the truth", "true", "m"),
            ]
        ),
        _known("time for a frame", "seconds", "ms"),
        Column("time for a simulated second", "s", read=_simulated_second, folded=True),
        text("remark", _fate),
    ),
    subjects=lambda results: points(results, MOTION),
    ranked=lambda point: point.is_whole,
    shows="Distances are root mean squares over the particles after the last frame. Diverged "
    "means that a particle was farther from its true place than the cloth is wide.",
    measured=lambda found: f"{_CLOTH}{_FAIR}{_TRUTH}: {_certainty(found)}.",
    summary=_motion_summary,
    figures=(figures.to_implicit_euler, figures.to_the_truth),
)


iterations = Layout(
    f"How many iterations does an error of {SOLVED} take?",
    "cloth_iterations",
    "Iterations needed in one step",
    columns=(
        Column("stiffness", "N/m", read=lambda record: int(record.settings["stiffness"])),
        SOLVER,
        *(
            Column(
                f"to {decade}",
                read=partial(_needed, decade=decade),
                best="least",
                folded=decade not in TARGETS,
            )
            for decade in DECADES
        ),
        *folded([number("tried")]),
        *least([number("least error", "least")]),
    ),
    subjects=lambda results: results.all("cloth", task=NEEDED),
    shows="Iterations until |x − x*| / |y − x*| is at most so much; nothing where all that "
    "were tried did not suffice.",
    measured=lambda records: (
        f"{_CLOTH}{_sizes(records)} particles. x* to 25 digits, in decimal arithmetic."
    ),
    summary=_needed_summary,
)


stability = Layout(
    "How long may the steps of explicit solvers be?",
    "cloth_stability",
    "The longest stable step of explicit solvers",
    subjects=lambda results: [
        limit for record in results.all("cloth", task=STABILITY) for limit in _limits(record)
    ],
    columns=(
        text("solver", lambda limit: limit.record.solver),
        Column("stiffness", "N/m", read=lambda limit: limit.stiffness),
        Column("longest stable step", "ms", read=lambda limit: limit.step),
        Column("2 / ω", "ms", read=lambda limit: limit.theory),
        Column("of 2 / ω", read=lambda limit: limit.share, best="greatest"),
        text("remark", lambda limit: limit.record.notes["remark"]),
    ),
    shows="Symplectic Euler is stable up to h = 2 / ω, the classical Runge-Kutta method up to "
    "2.828 / ω; ω² is the largest eigenvalue of M⁻¹ K at rest.",
    measured=f"A cloth of {STABILITY_SIZE} × {STABILITY_SIZE} particles hangs at rest and is "
    f"pushed by {words(AMPLITUDE)} m along its highest mode; a step is stable if that has grown "
    f"less than {GROWTH:g}-fold after {STABILITY_STEPS} steps. Found by bisection to a relative "
    f"error of {words(BISECTION)}.",
    summary=_stability_summary,
    compared=0,
)


def _as_published(results: Results) -> list[Record]:
    records = results.all("cloth", task=LIU)
    return [r for r in records if r.solver in published.LIU_2013 and "seconds" in r.arrays]


def _vertices(records: Sequence[Record]) -> int:
    return int(records[0].arrays["vertices"]) if records else 0


def _median(record: Record) -> float:
    return metrics.spread(record.arrays["seconds"]).median


def _liu_summary(records: Sequence[Record]) -> Summary:
    return Summary(
        f"A frame of {words(_vertices(records))} vertices:",
        tuple(
            f"{label(record.solver)}, {published.LIU_2013[record.solver].done}: "
            f"{words_in(_median(record), 'ms')}, published "
            f"{words_in(published.LIU_2013[record.solver].seconds, 'ms')}; here an error of "
            f"{words(float(record.arrays['error']))} is left"
            for record in records
        ),
    )


liu_2013 = Layout(
    "What did Liu et al. (2013) measure, and what do we?",
    "cloth_liu_2013",
    "The times of Liu et al. (2013), and here",
    columns=(
        SOLVER,
        text("a frame by", lambda record: published.LIU_2013[record.solver].done),
        Column("published", "ms", read=lambda record: published.LIU_2013[record.solver].seconds),
        Column("here", "ms", read=_median, best="least"),
        number("here, error left", "error"),
    ),
    subjects=_as_published,
    shows="The error is |x − x*| / |y − x*| as above; 1 is no nearer than the inertial start y. "
    "What the paper’s ten iterations leave is not known to us.",
    measured=lambda records: (
        "Published: 6,561 vertices; read in the abstract and captions, so springs, "
        "stiffness, step and machine are not known to us. Here: "
        f"{words(_vertices(records))} particles, "
        f"{words(int(published.LIU_2013_STIFFNESS))} N/m, one step of "
        f"{words_in(published.LIU_2013_FRAME, 'ms')} from mid-fall, on one core; "
        f"Newton to a residual of {words(published.LIU_2013['newton'].settings['tolerance'])}."
    ),
    summary=_liu_summary,
    compared=0,
)


LAYOUTS = (iterations, one_step, motion, stability, liu_2013)
