"""One cloth for every solver: work against precision, iterations, limits of stability."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.results import Results, label, listed
from ...presentation.tables import Cell, Column, Summary, Table, words
from ..published import problem as published
from . import LIU, MISSING, MOTION, NEEDED, ONE_STEP, STABILITY

TARGETS = {"1e-3": 1e-3, "1e-6": 1e-6}
DECADES = tuple(f"1e-{p}" for p in range(1, 9))
EVERY = "every cloth"
# So near to the truth [m] a motion is hard to tell from it by eye.
_NEAR = 1e-2
_CLOTH = (
    "A cloth of the lab’s springs without dampers, 2 m a side and 1 kg whatever its particles, "
    "under 9.81 m/s², held at two corners, 0.4 s after it was let go; frames of 1/60 s. "
)
_FAIR = (
    "Every solver works in a process of its own on one core and is timed frame by frame, without "
    "set-up and conversions. Newton the engine computes in single precision, all others in double. "
)
_TRUTH = (
    "Converged implicit Euler is our Newton in steps of a frame, at the rounding floor. The truth "
    "is the classical Runge-Kutta method far below its limit of stability"
)


class Point(NamedTuple):
    """A solver with one setting on one cloth.

    Attributes:
        stiffness: of the springs [N/m].
        particles: along each side.
        solver: the method.
        rung: the setting.
        values: what was measured, by name.
        record: where it is from.
    """

    stiffness: float
    particles: int
    solver: str
    rung: str
    values: dict[str, float]
    record: Record


def points(results: Results, task: str) -> list[Point]:
    """Return all points of a task, cloth by cloth: stiffness first, then particles."""
    found = [p for record in results.all("cloth", task=task) for p in _points_of(record)]
    return sorted(found, key=lambda point: (point.stiffness, point.particles))


def _points_of(record: Record) -> Iterator[Point]:
    if "particles" not in record.arrays:
        return
    count = record.arrays["particles"].size
    whole = {name: values for name, values in record.arrays.items() if values.size == count}
    for i in range(count):
        values = {name: float(array[i]) for name, array in whole.items()}
        yield Point(
            record.settings["stiffness"], int(values["particles"]), record.solver,
            record.facts["rungs"][i], values,
            record,
        )  # fmt: skip


def _cloth_of(point: Point) -> str:
    return f"{point.particles} × {point.particles}, {words(int(point.stiffness))} N/m"


def _missing_rows(results: Results, cells: int) -> list[tuple[Cell, ...]]:
    return [
        (EVERY, record.solver, *[None] * (cells - 3), record.notes["remark"])
        for record in results.all("cloth", task=MISSING)
    ]


def one_step(results: Results) -> Table:
    """Return how soon every solver is near the converged step."""
    found = points(results, ONE_STEP)
    columns = (
        Column("cloth", words=True), Column("solver", words=True),
        *(
            column
            for name in TARGETS
            for column in (
                Column(f"time to {name}", "ms"), Column(f"{name} by", words=True),
            )
        ),
        Column("least error"), Column("least by", words=True), Column("remark", words=True),
    )  # fmt: skip
    rows = [_step_row(group) for group in _groups(found)] if found else []
    rows += _missing_rows(results, len(columns))
    return Table(
        "cloth_peers_step",
        "One step of a falling cloth by every solver",
        columns,
        tuple(rows),
        shows="The error is |x − x*| / |y − x*|, what is left of the distance between the inertial "
        "start y and the converged step x*. Explicit solvers and those that solve one linear "
        "system do another step: their error stays, however long they take.",
        measured=f"{_CLOTH}{_FAIR}{_TRUTH}. Times are medians of up to five; settings are those of "
        "a ladder, of which the cheapest that suffices counts.",
        summary=_step_summary(found),
    )


def _groups(found: Sequence[Point]) -> list[list[Point]]:
    """Return the points of each solver on each cloth, in order."""
    groups: dict[tuple[float, int, str], list[Point]] = {}
    for point in found:
        groups.setdefault((point.stiffness, point.particles, point.solver), []).append(point)
    return list(groups.values())


def _reached(group: Sequence[Point], target: float) -> Point | None:
    seconds, errors = (np.array([p.values[name] for p in group]) for name in ("seconds", "error"))
    i = metrics.cheapest_within(seconds, errors, target)
    return None if i is None else group[i]


def _step_row(group: Sequence[Point]) -> tuple[Cell, ...]:
    cells: list[Cell] = [_cloth_of(group[0]), group[0].solver]
    for target in TARGETS.values():
        point = _reached(group, target)
        cells += [None, None] if point is None else [_milliseconds(point), point.rung]
    best = min(group, key=lambda point: point.values["error"])
    return (*cells, best.values["error"], best.rung, _remark(group))


def _remark(group: Sequence[Point]) -> str:
    """Return what a record says of this cloth."""
    record = group[0].record
    remarks = zip(record.arrays["remark_particles"], record.facts["remarks"], strict=True)
    return "; ".join(sentence for particles, sentence in remarks if particles == group[0].particles)


def _milliseconds(point: Point) -> float:
    return metrics.milliseconds(point.values["seconds"])


def _step_summary(found: Sequence[Point]) -> Summary:
    said = []
    for cloth in dict.fromkeys(_cloth_of(point) for point in found):
        groups = _groups([point for point in found if _cloth_of(point) == cloth])
        fastest = [f"to {name} {_fastest(groups, target)}" for name, target in TARGETS.items()]
        said.append(f"{cloth}: {listed(fastest)}")
    return Summary("The fastest of all solvers in one step:", tuple(said)) if said else Summary()


def _engine(point: Point) -> str:
    return registry.find(point.solver).engine


def _fastest(groups: Sequence[Sequence[Point]], target: float) -> str:
    reached = [point for group in groups if (point := _reached(group, target)) is not None]
    if not reached:
        return "none"
    best = min(reached, key=_milliseconds)
    others = [p for p in reached if _engine(p) != _engine(best)]
    after = min(others, key=_milliseconds) if others else None
    beside = "" if after is None else f" (then {after.solver}, {words(_milliseconds(after))} ms)"
    return f"{best.solver}, {words(_milliseconds(best))} ms{beside}"


def motion(results: Results) -> Table:
    """Return how far every solver's motion is from implicit Euler's and from the truth."""
    found = points(results, MOTION)
    columns = (
        Column("cloth", words=True), Column("solver", words=True),
        Column("a frame by", words=True), Column("frames"),
        Column("distance from implicit Euler", "m"), Column("distance from the truth", "m"),
        Column("time for a frame", "ms"), Column("time for a simulated second", "s"),
        Column("remark", words=True),
    )  # fmt: skip
    rows = [_motion_row(point) for point in found]
    rows += _missing_rows(results, len(columns))
    return Table(
        "cloth_peers_motion",
        "A falling cloth by every solver, frame after frame",
        columns,
        tuple(rows),
        shows="Distances are root mean squares over the particles after the last frame. Diverged "
        "means that a particle was farther from its true place than the cloth is wide.",
        measured=f"{_CLOTH}{_FAIR}{_TRUTH}: {_certainty(found)}.",
        summary=_motion_summary(found),
    )  # fmt: skip


def _motion_row(point: Point) -> tuple[Cell, ...]:
    values = point.values
    apart = [None if np.isnan(values[name]) else values[name] for name in ("implicit", "true")]
    frame = None if np.isnan(values["seconds"]) else values["seconds"]
    return (
        _cloth_of(point), point.solver, point.rung, int(values["frames"]), *apart,
        None if frame is None else metrics.milliseconds(frame),
        None if frame is None else metrics.ratio(frame, point.record.settings["frame"]),
        _fate(point),
    )  # fmt: skip


def _fate(point: Point) -> str:
    if point.values["diverged"]:
        return "diverged"
    if point.values["frames"] < point.values["wanted"]:
        said = _remark([point])
        return said or f"out of time before frame {int(point.values['frames']) + 1}"
    return ""


def is_whole(point: Point) -> bool:
    """Return whether a motion got to its end."""
    return not point.values["diverged"] and point.values["frames"] == point.values["wanted"]


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
    if not found:
        return Summary()
    said = []
    for cloth in dict.fromkeys(_cloth_of(point) for point in found):
        whole = [p for p in found if _cloth_of(p) == cloth and is_whole(p)]
        if whole:
            said.append(f"{cloth}: {_nearest(whole)}")
    sentence = f"With some settings diverged: {listed(list(lost))}." if lost else "None diverged."
    return Summary(f"{sentence} Nearest to the truth:", tuple(said))


def _nearest(whole: Sequence[Point]) -> str:
    best = min(whole, key=lambda point: point.values["true"])
    said = f"{best.solver} by {best.rung}, {words(best.values['true'])} m"
    close = [point for point in whole if point.values["true"] <= _NEAR]
    if not close:
        return said
    first = min(close, key=_milliseconds)
    return (
        f"{said}; the fastest within {words(_NEAR)} m {first.solver} by {first.rung}, "
        f"{words(_milliseconds(first))} ms a frame"
    )


def iterations(results: Results) -> Table:
    """Return the iterations of our solvers to each power of ten."""
    records = results.all("cloth", task=NEEDED)
    size = records[0].settings["size"] if records else 0
    return Table(
        "cloth_iterations",
        "Iterations needed in one step",
        (
            Column("stiffness", "N/m"), Column("solver", words=True),
            *(Column(f"to {decade}") for decade in DECADES),
            Column("tried"), Column("least error"),
        ),
        tuple(_needed_row(record) for record in records),
        shows="Iterations until |x − x*| / |y − x*| is at most so much; nothing where all that "
        "were tried did not suffice.",
        measured=f"{_CLOTH}{size} × {size} particles. x* by Newton at the rounding floor.",
        summary=_needed_summary(records),
    )  # fmt: skip


def _needed_row(record: Record) -> tuple[Cell, ...]:
    needed = [None if np.isnan(n) else int(n) for n in record.arrays["needed"]]
    return (
        int(record.settings["stiffness"]), label(record.solver), *needed,
        int(record.arrays["tried"]), float(record.arrays["least"]),
    )  # fmt: skip


def _needed_summary(records: Sequence[Record]) -> Summary:
    said = []
    for stiffness in dict.fromkeys(record.settings["stiffness"] for record in records):
        mine = [record for record in records if record.settings["stiffness"] == stiffness]
        counts = [f"{label(r.solver)} {_count_to(r, DECADES.index('1e-6'))}" for r in mine]
        said.append(f"{words(int(stiffness))} N/m: {listed(counts)}")
    return Summary("Iterations to an error of 1e-6:", tuple(said)) if said else Summary()


def _count_to(record: Record, i: int) -> str:
    needed = record.arrays["needed"][i]
    return (
        f"more than {words(int(record.arrays['tried']))}"
        if np.isnan(needed)
        else words(int(needed))
    )


def stability(results: Results) -> Table:
    """Return the longest stable steps, beside what theory has for them."""
    rows: list[tuple[Cell, ...]] = []
    for record in results.all("cloth", task=STABILITY):
        arrays = record.arrays
        for k, limit, frequency in zip(
            arrays["stiffness"], arrays["limit"], arrays["frequency"], strict=True
        ):
            theory = metrics.ratio(2.0, float(frequency))
            found = None if np.isnan(limit) else metrics.milliseconds(float(limit))
            share = None if np.isnan(limit) else metrics.ratio(float(limit), theory)
            rows.append(
                (record.solver, int(k), found, metrics.milliseconds(theory), share,
                 record.notes["remark"])
            )  # fmt: skip
    return Table(
        "cloth_stability",
        "The longest stable step of explicit solvers",
        (
            Column("solver", words=True), Column("stiffness", "N/m"),
            Column("longest stable step", "ms"), Column("2 / ω", "ms"),
            Column("of 2 / ω"), Column("remark", words=True),
        ),
        tuple(rows),
        shows="Symplectic Euler is stable up to h = 2 / ω, the classical Runge-Kutta method up to "
        "2.828 / ω; ω² is the largest eigenvalue of M⁻¹ K at rest.",
        measured="A cloth of 6 × 6 particles hangs at rest and is pushed by 1e-5 m along its "
        "highest mode; a step is stable if that has not grown a hundredfold 400 steps later. Found "
        "by bisection to two ten-thousandths.",
        summary=_stability_summary(rows),
    )  # fmt: skip


def _stability_summary(rows: Sequence[tuple[Cell, ...]]) -> Summary:
    shares = {row[0]: row[4] for row in rows if row[4] is not None}
    said = tuple(f"{solver}: {words(share)} × 2 / ω" for solver, share in shares.items())
    return Summary("The longest stable step:", said) if said else Summary()


def liu_2013(results: Results) -> Table:
    """Return the published times of Liu et al. 2013, and ours for as many vertices."""
    wanted = [r for r in results.all("cloth", task=LIU) if r.solver in published.LIU_2013]
    records = [r for r in wanted if "seconds" in r.arrays]
    rows = []
    for record in records:
        frame = published.LIU_2013[record.solver]
        here = metrics.spread(record.arrays["seconds"]).median
        rows.append(
            (
                label(record.solver), frame.done, metrics.milliseconds(frame.seconds),
                metrics.milliseconds(here), float(record.arrays["error"]),
            )
        )  # fmt: skip
    vertices = int(records[0].arrays["vertices"]) if records else 0
    return Table(
        "cloth_liu_2013",
        "The times of Liu et al. (2013), and here",
        (
            Column("solver", words=True), Column("a frame by", words=True),
            Column("published", "ms"), Column("here", "ms"), Column("here, error left"),
        ),
        tuple(rows),
        shows="The error is |x − x*| / |y − x*| as above; the paper’s ten iterations leave most of "
        "it.",
        measured="Published: 6,561 vertices; read in the abstract and captions, so springs, "
        f"stiffness, step and machine are not known to us. Here: {words(vertices)} particles, 81 × "
        f"81, {words(int(published.LIU_2013_STIFFNESS))} N/m, "
        f"one step of {words(metrics.milliseconds(published.LIU_2013_FRAME))} ms from mid-fall, on "
        "one core; Newton to a residual of 1e-6.",
        summary=_liu_summary(rows),
    )  # fmt: skip


def _liu_summary(rows: Sequence[tuple[Cell, ...]]) -> Summary:
    if not rows:
        return Summary()
    said = tuple(f"{row[0]}: {words(row[3])} ms, published {words(row[2])} ms" for row in rows)
    return Summary("A frame of 6,561 vertices:", said)
