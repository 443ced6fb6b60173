"""How the solvers of an implicit Euler step converge, and what a few iterations leave behind."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference import Outcome

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, by_problem, counted, label, settings
from ...peers import registry
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    folded,
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
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from ..pictures import figures as pictures
from . import DAMPERS, FEW, ONE_STEP, SWING, figures

LISTED = (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000)
# Those whose residual is listed beside the error.
CHECKED = ("local_global", "newton")
# The summary counts the iterations to this error.
TARGET_ERROR = 1e-6


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

    @property
    def title(self) -> str:
        """How the cloth is written."""
        return next(iter(self.by.values())).title

    def reached(self, solver: str, what: str) -> float | None:
        """Return the residual or error that a solver has reached, None if it stopped before."""
        values = self.by[solver].arrays[what] if solver in self.by else np.array([])
        return float(values[self.k]) if self.k < values.size else None


newton_steps = Layout(
    "Does Newton always get there?",
    "cloth_newton",
    "Newton over consecutive steps of the swinging cloth",
    subjects=lambda results: results.all("cloth", task=SWING),
    columns=(
        titled("cloth"),
        Column("steps", read=lambda record: record.arrays["iterations"].size),
        share("converged", _solved, best="greatest"),
        *spread("iterations", "iterations"),
        *spread("residual", "residual"),
        Column(
            "steps at the rounding floor",
            read=lambda record: np.count_nonzero(record.arrays["at_floor"]),
            folded=True,
        ),
    ),
    shows="The residual is |grad g(x)| over its value at the inertial start y, or over what "
    "only rounding leaves where that is more.",
    measured=lambda records: (
        f"The lab’s cloth let go from rest; steps of {lengths_of_steps(records)} ms after "
        f"the first {settings(records, 'first')}, to a residual of "
        f"{settings(records, 'tolerance')} or the rounding floor."
    ),
    summary=_newton_summary,
)


def _rivals() -> list[str]:
    return [solver.name for solver in registry.followed_step_solvers()]


def _iterations(results: Results) -> list[_Iteration]:
    records = [r for r in results.all("cloth", task=ONE_STEP) if r.solver in _rivals()]
    return [
        row
        for cloth in by_problem(records).values()
        for row in (_Iteration({record.solver: record for record in cloth}, k) for k in LISTED)
        if any(row.reached(solver, "error") is not None for solver in row.by)
    ]


def _records(rows: Sequence[_Iteration]) -> list[Record]:
    return [record for row in rows for record in row.by.values()]


def _reached(solver: str, what: str) -> Column:
    return Column(
        f"{what}, {label(solver)}", read=lambda row: row.reached(solver, what), group=what
    )


def _convergence_summary(rows: Sequence[_Iteration]) -> Summary:
    cloths = {row.title: row.by for row in rows}
    return Summary(
        f"Iterations until the error is {words(TARGET_ERROR)}:",
        tuple(
            f"{title}: {', '.join(f'{label(r)} {_needed(by[r])}' for r in _rivals() if r in by)}"
            for title, by in cloths.items()
        ),
    )


def _needed(record: Record) -> str:
    needed = metrics.first_below(record.arrays["error"], TARGET_ERROR)
    done = record.arrays["error"].size - 1
    return words(needed) if needed is not None else f"more than {words(done)}"


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


convergence = Layout(
    "How fast do local/global and Newton converge?",
    "cloth_convergence",
    "Convergence of one implicit Euler step",
    columns=lambda rows: (
        text("cloth", lambda row: row.title),
        Column("iterations", read=lambda row: row.k),
        *(_reached(rival, "error") for rival in _rivals()),
        *folded(_reached(rival, "residual") for rival in CHECKED),
    ),
    subjects=_iterations,
    shows="The error is |x − x*| / |y − x*|: what is left of the distance between the "
    "inertial start y and the converged step x*. Where it stands still it is at the floor: to "
    "round x* to float64 leaves as much.",
    measured=lambda rows: (
        f"Step {settings(_records(rows), 'step')} of the motion, "
        f"{lengths_of_steps(_records(rows))} ms; "
        "x* to 25 digits: Newton’s answer, refined in decimal arithmetic."
    ),
    summary=_convergence_summary,
    figures=(figures.cloth_convergence,),
)


few_iterations = Layout(
    "How far is one solve of Q x = b from the step it stands for?",
    "cloth_few_iterations",
    "The lab’s Q x = b: a fixed number of local/global iterations",
    subjects=lambda results: results.all("cloth", task=FEW),
    columns=(
        titled("cloth"),
        setting("iterations a step", "iterations"),
        *spread("error of a step", "error", of=(MEDIAN, LARGEST)),
        *spread("distance of a step", "distance", "m"),
        Column("drift in the end", "m", read=lambda record: record.arrays["drift"][-1]),
        Column("drift, share of the path", "%", read=_share_of_path),
    ),
    shows="Error and distance are those of one such step begun at each state of the converged "
    "motion: relative as above, and as root mean square over the particles. Drift is how far "
    "the cloth is from the converged one when all steps are taken so; the path is how far the "
    "converged one has moved.",
    measured=lambda records: (
        f"{settings(records, 'steps')} steps of {lengths_of_steps(records)} ms of the "
        f"swinging cloth after the first {settings(records, 'first')}; one iteration is the lab’s "
        "version."
    ),
    summary=_few_summary,
    figures=(pictures.falling_cloth,),
)


def _damped_steps(results: Results) -> list[tuple[Record, int]]:
    records = results.all("cloth", task=DAMPERS)
    return [(record, i) for record in records for i in range(record.arrays["h"].size)]


def _damper_summary(steps: Sequence[tuple[Record, int]]) -> Summary:
    records = [record for record, i in steps if i == 0]
    return Summary(
        "The forces of the two laws differ, relatively, by:",
        tuple(f"{r.title}: {_difference_at(r, 0)}, {_difference_at(r, -1)}" for r in records),
    )


def _order(record: Record, i: int) -> float | None:
    apart = record.arrays["apart"]
    return np.log2(apart[i - 1] / apart[i]) if i else None


def _difference_at(record: Record, i: int) -> str:
    h, apart = float(record.arrays["h"][i]), float(record.arrays["apart"][i])
    return f"{words(apart)} at {words_in(h, 'ms')}"


dampers = Layout(
    "How far apart are the two laws of dampers?",
    "cloth_dampers",
    "Two laws of dampers at the end of one step",
    columns=(
        text("cloth", lambda step: step[0].title),
        Column("h", "ms", read=lambda step: step[0].arrays["h"][step[1]]),
        Column("difference", read=lambda step: step[0].arrays["apart"][step[1]]),
        Column("observed order", read=lambda step: _order(*step)),
    ),
    subjects=_damped_steps,
    shows="A step’s damper has an energy and pulls with −(c/h)(l − l_n) u; an explicit "
    "integrator’s pulls with −c ((v_i − v_j)·u) u. The difference of all forces over those of "
    "the second law, where both are at home: at the end of the step, with its velocities. It "
    "comes from the springs’ rotation within the step and shrinks with h, to first order.",
    measured=lambda steps: (
        "The lab’s cloth with a damping of "
        f"{settings((step[0] for step in steps), 'damping')} N s/m after "
        f"{settings((step[0] for step in steps), 'first')} steps of its swing; one converged step "
        "of each length from there."
    ),
    summary=_damper_summary,
)


LAYOUTS = (few_iterations, convergence, newton_steps, dampers)
