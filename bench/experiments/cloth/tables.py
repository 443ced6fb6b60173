"""How the solvers of an implicit Euler step converge, and what a few iterations leave behind."""

from collections.abc import Sequence

import numpy as np

from reference import Outcome

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.results import Results, by_problem, counted, label, settings
from ...presentation.tables import INTERVAL, Cell, Column, Summary, Table, words
from . import DAMPERS, FEW, ONE_STEP, SWING

LISTED = (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000)
# Those whose residual is listed beside the error.
CHECKED = ("local_global", "newton")
# The answer in a sentence counts the iterations to this error.
TARGET_ERROR = 1e-6


def newton_steps(results: Results) -> Table:
    """Return how Newton does over consecutive steps."""
    records = results.all("cloth", task=SWING)
    return Table(
        "cloth_newton",
        "Newton over consecutive steps of the swinging cloth",
        (
            Column("cloth", words=True),
            Column("steps"),
            Column("converged", note=INTERVAL),
            Column("iterations, median"),
            Column("iterations, largest"),
            Column("residual, median"),
            Column("residual, largest"),
            Column("steps at the rounding floor"),
        ),
        tuple(_newton_row(record) for record in records),
        shows="The residual is |grad g(x)| over its value at the inertial start y, or over what "
        "rounding alone leaves where that is more.",
        measured=f"The lab’s cloth let go from rest; steps of {_milliseconds(records)} ms after "
        f"the first {settings(records, 'first')}, to a residual of "
        f"{settings(records, 'tolerance')} or the rounding floor.",
        summary=_newton_summary(records),
    )


def _newton_row(record: Record) -> tuple[Cell, ...]:
    residual = metrics.spread(record.arrays["residual"])
    median, _, largest = metrics.whole(record.arrays["iterations"])
    return (
        record.title,
        int(record.arrays["iterations"].size),
        metrics.share(_solved(record)),
        median,
        largest,
        residual.median,
        residual.largest,
        metrics.share(record.arrays["at_floor"]).hits,
    )


def _newton_summary(records: Sequence[Record]) -> Summary:
    if not records:
        return Summary()
    steps = sum(record.arrays["iterations"].size for record in records)
    done = sum(metrics.share(_solved(record)).hits for record in records)
    iterations = max(metrics.whole(record.arrays["iterations"])[2] for record in records)
    residual = max(metrics.spread(record.arrays["residual"]).largest for record in records)
    return Summary(
        f"Newton converged in {words(done)} of {words(steps)} steps, with at most "
        f"{counted(int(iterations), 'iteration')} and a residual of at most {words(residual)}."
    )


def _solved(record: Record) -> np.ndarray:
    return np.isin(record.arrays["outcome"], [outcome for outcome in Outcome if outcome.solved])


def convergence(results: Results) -> Table:
    """Return residual and error after each of some iterations of one step."""
    rivals = [solver.name for solver in registry.followed_step_solvers()]
    cloths = by_problem(results.all("cloth", task=ONE_STEP)).values()
    solved = [
        (cloth[0].title, {r: next((s for s in cloth if s.solver == r), None) for r in rivals})
        for cloth in cloths
    ]
    rows = [
        (
            title,
            k,
            *(_after(by[rival], "error", k) for rival in rivals),
            *(_after(by[rival], "residual", k) for rival in CHECKED),
        )
        for title, by in solved
        for k in LISTED
        if any(_after(record, "error", k) is not None for record in by.values())
    ]
    records = [record for _, by in solved for record in by.values() if record is not None]
    return Table(
        "cloth_convergence",
        "Convergence of one implicit Euler step",
        (
            Column("cloth", words=True),
            Column("iterations"),
            *(Column(f"{label(rival)}: error") for rival in rivals),
            *(Column(f"{label(rival)}: residual") for rival in CHECKED),
        ),
        tuple(rows),
        shows="The error is |x − x*| / |y − x*|: what is left of the distance between the "
        "inertial start y and the converged step x*. Where it stands still, rounding is reached.",
        measured=f"Step {settings(records, 'step')} of the motion, {_milliseconds(records)} ms; "
        "x* by Newton, iterated far beyond the rounding floor.",
        summary=_convergence_summary(solved),
    )


def _after(record: Record | None, what: str, k: int) -> float | None:
    if record is None or k >= record.arrays[what].size:
        return None
    return float(record.arrays[what][k])


def _convergence_summary(solved: Sequence[tuple[str, dict[str, Record | None]]]) -> Summary:
    points = []
    for title, by in solved:
        needed = [f"{label(r.solver)} {_needed(r)}" for r in by.values() if r is not None]
        points.append(f"{title}: {', '.join(needed)}")
    return Summary(f"Iterations until the error is {words(TARGET_ERROR)}:", tuple(points))


def _needed(record: Record) -> str:
    needed = metrics.first_below(record.arrays["error"], TARGET_ERROR)
    done = record.arrays["error"].size - 1
    return words(needed) if needed is not None else f"more than {words(done)}"


def few_iterations(results: Results) -> Table:
    """Return the error of the lab's Q x = b, one local/global iteration, and of a few more."""
    records = results.all("cloth", task=FEW)
    return Table(
        "cloth_few_iterations",
        "The lab’s Q x = b: a fixed number of local/global iterations",
        (
            Column("cloth", words=True),
            Column("iterations a step"),
            Column("error of a step, median"),
            Column("error of a step, largest"),
            Column("distance of a step, median", "m"),
            Column("distance of a step, largest", "m"),
            Column("drift in the end", "m"),
            Column("drift, share of the path", "%"),
        ),
        tuple(_few_row(record) for record in records),
        shows="Error and distance are those of one such step begun at each state of the converged "
        "motion: relative as above, and as root mean square over the particles. Drift is how far "
        "the cloth is from the converged one when all steps are taken so; the path is how far the "
        "converged one has moved.",
        measured=f"{settings(records, 'steps')} steps of {_milliseconds(records)} ms of the "
        f"swinging cloth after the first {settings(records, 'first')}; one iteration is the lab’s "
        "version.",
        summary=_few_summary(records),
    )


def _few_row(record: Record) -> tuple[Cell, ...]:
    error, distance = (metrics.spread(record.arrays[name]) for name in ("error", "distance"))
    drift, path = _drift(record)
    return (
        record.title, record.settings["iterations"], error.median,
        error.largest, distance.median, distance.largest, drift, metrics.percent(drift, path),
    )  # fmt: skip


def _few_summary(records: Sequence[Record]) -> Summary:
    points = []
    for record in records:
        if record.settings["iterations"] == 1:
            error = metrics.percent(metrics.spread(record.arrays["error"]).median, 1.0)
            drift, path = _drift(record)
            points.append(
                f"{record.title}: {words(error)} %; the cloth drifts by {words(drift)} m,"
                f" {words(metrics.percent(drift, path))} % of its path, in "
                f"{record.settings['steps']} steps"
            )
    return Summary(
        "What one iteration leaves of the distance to the converged step, in the median:",
        tuple(points),
    )


def dampers(results: Results) -> Table:
    """Return how far the two laws of dampers are apart at the end of one step."""
    records = results.all("cloth", task=DAMPERS)
    return Table(
        "cloth_dampers",
        "Two laws of dampers at the end of one step",
        (
            Column("cloth", words=True),
            Column("h", "ms"),
            Column("difference"),
            Column("observed order"),
        ),
        tuple(row for record in records for row in _damper_rows(record)),
        shows="A step’s damper has an energy and pulls with −(c/h)(l − l_n) u; an explicit "
        "integrator’s pulls with −c ((v_i − v_j)·u) u. The difference of all forces over those of "
        "the second law, where both are at home: at the end of the step, with its velocities. It "
        "comes from the springs’ rotation within the step and shrinks with h, to first order.",
        measured=f"The lab’s cloth with a damping of {settings(records, 'damping')} N s/m after "
        f"{settings(records, 'first')} steps of its swing; one converged step of each length from "
        "there.",
        summary=_damper_summary(records),
    )


def _damper_rows(record: Record) -> list[tuple[Cell, ...]]:
    apart = record.arrays["apart"]
    orders = [None, *np.log2(apart[:-1] / apart[1:])]
    return [
        (record.title, metrics.milliseconds(float(h)), float(difference), order)
        for h, difference, order in zip(record.arrays["h"], apart, orders, strict=True)
    ]


def _damper_summary(records: Sequence[Record]) -> Summary:
    return Summary(
        "The forces of the two laws differ, relatively, by:" if records else "",
        tuple(
            f"{record.title}: {words(float(record.arrays['apart'][0]))} at "
            f"{words(metrics.milliseconds(float(record.arrays['h'][0])))} ms, "
            f"{words(float(record.arrays['apart'][-1]))} at "
            f"{words(metrics.milliseconds(float(record.arrays['h'][-1])))} ms"
            for record in records
        ),
    )


def _drift(record: Record) -> tuple[float, float]:
    """Return drift and path at the end [m]."""
    return float(record.arrays["drift"][-1]), float(record.arrays["path"][-1])


def _milliseconds(records: Sequence[Record]) -> str:
    lengths = {record.settings["h"] for record in records}
    return " or ".join(words(metrics.milliseconds(h)) for h in sorted(lengths)) or "–"
