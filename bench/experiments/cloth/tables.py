"""How the solvers of an implicit Euler step converge, and what a few iterations leave behind."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from reference import Outcome

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.columns import (
    LARGEST,
    MEDIAN,
    largest,
    lengths_of_steps,
    setting,
    share,
    spread,
    spread_of,
    text,
    titled,
    words_in,
)
from ...presentation.entry import Entry
from ...presentation.results import Results, by_problem, counted, label, settings
from ...presentation.tables import Column, Summary, Table, listing, tabulate, words
from ..pictures import figures as pictures
from . import DAMPERS, FEW, ONE_STEP, SWING, figures

LISTED = (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000)
# Those whose residual is listed beside the error.
CHECKED = ("local_global", "newton")
# The summary counts the iterations to this error.
TARGET_ERROR = 1e-6


def newton_steps(results: Results) -> Table:
    """Return how Newton does over consecutive steps."""
    records = results.all("cloth", task=SWING)
    return tabulate(
        "cloth_newton",
        "Newton over consecutive steps of the swinging cloth",
        (
            titled("cloth"),
            Column("steps", read=lambda record: record.arrays["iterations"].size),
            share("converged", _solved),
            *spread("iterations", "iterations"),
            *spread("residual", "residual"),
            Column(
                "steps at the rounding floor",
                read=lambda record: np.count_nonzero(record.arrays["at_floor"]),
            ),
        ),
        records,
        shows="The residual is |grad g(x)| over its value at the inertial start y, or over what "
        "rounding alone leaves where that is more.",
        measured=f"The lab’s cloth let go from rest; steps of {lengths_of_steps(records)} ms after "
        f"the first {settings(records, 'first')}, to a residual of "
        f"{settings(records, 'tolerance')} or the rounding floor.",
        summary=_newton_summary,
    )


def _newton_summary(records: Sequence[Record]) -> Summary:
    steps = sum(record.arrays["iterations"].size for record in records)
    done = sum(metrics.share(_solved(record)).hits for record in records)
    return Summary(
        f"Newton converged in {words(done)} of {words(steps)} steps, with at most "
        f"{counted(int(largest(records, 'iterations')), 'iteration')} and a residual of at most "
        f"{words(largest(records, 'residual'))}."
    )


def _solved(record: Record) -> np.ndarray:
    return np.isin(record.arrays["outcome"], [outcome for outcome in Outcome if outcome.solved])


class _Iteration(NamedTuple):
    """The records of a cloth, by solver, after so many iterations."""

    by: dict[str, Record]
    k: int

    def reached(self, solver: str, what: str) -> float | None:
        """Return the residual or error that a solver has reached, None if it stopped before."""
        values = self.by[solver].arrays[what] if solver in self.by else np.array([])
        return float(values[self.k]) if self.k < values.size else None


def convergence(results: Results) -> Table:
    """Return residual and error after each of some iterations of one step."""
    rivals = [solver.name for solver in registry.followed_step_solvers()]
    records = [r for r in results.all("cloth", task=ONE_STEP) if r.solver in rivals]
    rows = [
        row
        for cloth in by_problem(records).values()
        for row in (_Iteration({record.solver: record for record in cloth}, k) for k in LISTED)
        if any(row.reached(rival, "error") is not None for rival in rivals)
    ]
    return tabulate(
        "cloth_convergence",
        "Convergence of one implicit Euler step",
        (
            text("cloth", lambda row: next(iter(row.by.values())).title),
            Column("iterations", read=lambda row: row.k),
            *(_reached(rival, "error") for rival in rivals),
            *(_reached(rival, "residual") for rival in CHECKED),
        ),
        rows,
        shows="The error is |x − x*| / |y − x*|: what is left of the distance between the "
        "inertial start y and the converged step x*. Where it stands still, rounding is reached.",
        measured=f"Step {settings(records, 'step')} of the motion, {lengths_of_steps(records)} ms; "
        "x* by Newton, iterated far beyond the rounding floor.",
        summary=partial(_convergence_summary, rivals),
    )


def _reached(solver: str, what: str) -> Column:
    return Column(f"{label(solver)}: {what}", read=lambda row: row.reached(solver, what))


def _convergence_summary(rivals: Sequence[str], rows: Sequence[_Iteration]) -> Summary:
    cloths = {next(iter(row.by.values())).title: row.by for row in rows}
    return Summary(
        f"Iterations until the error is {words(TARGET_ERROR)}:",
        tuple(
            f"{title}: {', '.join(f'{label(r)} {_needed(by[r])}' for r in rivals if r in by)}"
            for title, by in cloths.items()
        ),
    )


def _needed(record: Record) -> str:
    needed = metrics.first_below(record.arrays["error"], TARGET_ERROR)
    done = record.arrays["error"].size - 1
    return words(needed) if needed is not None else f"more than {words(done)}"


def few_iterations(results: Results) -> Table:
    """Return the error of the lab's Q x = b, one local/global iteration, and of a few more."""
    records = results.all("cloth", task=FEW)
    return tabulate(
        "cloth_few_iterations",
        "The lab’s Q x = b: a fixed number of local/global iterations",
        (
            titled("cloth"),
            setting("iterations a step", "iterations"),
            *spread("error of a step", "error", of=(MEDIAN, LARGEST)),
            *spread("distance of a step", "distance", "m"),
            Column("drift in the end", "m", read=lambda record: record.arrays["drift"][-1]),
            Column("drift, share of the path", "%", read=_share_of_path),
        ),
        records,
        shows="Error and distance are those of one such step begun at each state of the converged "
        "motion: relative as above, and as root mean square over the particles. Drift is how far "
        "the cloth is from the converged one when all steps are taken so; the path is how far the "
        "converged one has moved.",
        measured=f"{settings(records, 'steps')} steps of {lengths_of_steps(records)} ms of the "
        f"swinging cloth after the first {settings(records, 'first')}; one iteration is the lab’s "
        "version.",
        summary=_few_summary,
    )


def _share_of_path(record: Record) -> float:
    return metrics.ratio(float(record.arrays["drift"][-1]), float(record.arrays["path"][-1]))


def _few_summary(records: Sequence[Record]) -> Summary:
    return Summary(
        "What one iteration leaves of the distance to the converged step, in the median:",
        tuple(
            f"{record.title}: {words_in(spread_of(record, 'error')[0], '%')}; the cloth drifts by "
            f"{words(float(record.arrays['drift'][-1]))} m, {words_in(_share_of_path(record), '%')}"
            f" of its path, in {record.settings['steps']} steps"
            for record in records
            if record.settings["iterations"] == 1
        ),
    )


def dampers(results: Results) -> Table:
    """Return how far the two laws of dampers are apart at the end of one step."""
    records = results.all("cloth", task=DAMPERS)
    return tabulate(
        "cloth_dampers",
        "Two laws of dampers at the end of one step",
        (
            text("cloth", lambda step: step[0].title),
            Column("h", "ms", read=lambda step: step[0].arrays["h"][step[1]]),
            Column("difference", read=lambda step: step[0].arrays["apart"][step[1]]),
            Column("observed order", read=lambda step: _order(*step)),
        ),
        [(record, i) for record in records for i in range(record.arrays["h"].size)],
        shows="A step’s damper has an energy and pulls with −(c/h)(l − l_n) u; an explicit "
        "integrator’s pulls with −c ((v_i − v_j)·u) u. The difference of all forces over those of "
        "the second law, where both are at home: at the end of the step, with its velocities. It "
        "comes from the springs’ rotation within the step and shrinks with h, to first order.",
        measured=f"The lab’s cloth with a damping of {settings(records, 'damping')} N s/m after "
        f"{settings(records, 'first')} steps of its swing; one converged step of each length from "
        "there.",
        summary=lambda _: listing(
            "The forces of the two laws differ, relatively, by:",
            (f"{r.title}: {_difference_at(r, 0)}, {_difference_at(r, -1)}" for r in records),
        ),
    )


def _order(record: Record, i: int) -> float | None:
    apart = record.arrays["apart"]
    return np.log2(apart[i - 1] / apart[i]) if i else None


def _difference_at(record: Record, i: int) -> str:
    h, apart = float(record.arrays["h"][i]), float(record.arrays["apart"][i])
    return f"{words(apart)} at {words_in(h, 'ms')}"


ENTRIES = (
    Entry(
        "How far is one solve of Q x = b from the step it stands for?",
        few_iterations,
        (pictures.falling_cloth,),
    ),
    Entry(
        "How fast do local/global and Newton converge?", convergence, (figures.cloth_convergence,)
    ),
    Entry("Does Newton always get there?", newton_steps),
    Entry("How far apart are the two laws of dampers?", dampers),
)
