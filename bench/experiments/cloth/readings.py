"""What the records of the lab's cloth say: how solvers converge, dampers, proofs."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Outcome

from ...harness import metrics
from ...harness.record import Record
from ...tables.columns import spread_of
from ...tables.results import Results, label
from ...tables.table import words
from ..cloth_peers import DECADES, NEEDED
from ..newton.values import Certified, CertifiedDetails
from . import DAMPERS, FEW, ONE_STEP, SWING, values

# Iterations after which errors are listed; consecutive steps make as many, but for the last.
LISTED = (1, 10, 100, 1000)


class FewIterations(NamedTuple):
    """Consecutive steps of a few iterations each, begun at the states of the converged motion.

    Attributes:
        record: what was measured.
        median_error: of a step.
        largest_error: of a step.
        drift: from the converged motion in the end, if all steps are taken so [m].
        drift_share: the drift over the converged motion's path.
    """

    record: Record
    median_error: float
    largest_error: float
    drift: float
    drift_share: float


class Convergence(NamedTuple):
    """How a solver converges on a cloth: in one step, and in consecutive ones.

    Attributes:
        cloth: how the cloth is written.
        solver: the solver's label.
        one_step: iterations of one step of the lab's cloth.
        counted: those of one step of the falling cloth, counted to each error.
        few: consecutive steps of so many iterations each.
        converged: consecutive steps that were converged.
    """

    cloth: str
    solver: str
    one_step: Record | None
    counted: Record | None
    few: Mapping[int, FewIterations]
    converged: Record | None

    def after(self, quantity: str, count: int) -> float | None:
        """Return the error or residual of one step after so many iterations."""
        numbers = getattr(self.one_step.values, quantity) if self.one_step else np.zeros(0)
        return float(numbers[count]) if count < numbers.size else None

    def needed(self, decade: str) -> int | None:
        """Return the iterations of one step to an error of so much, None if none sufficed."""
        if self.one_step:
            return metrics.first_below(self.one_step.values.error, float(decade))
        count = self.counted.values.needed[DECADES.index(decade)] if self.counted else np.nan
        return None if np.isnan(count) else int(count)

    @property
    def trial(self) -> tuple[int, float] | tuple[None, None]:
        """The iterations that were made of one step, and the least error."""
        if self.one_step:
            errors = self.one_step.values.error
            return errors.size - 1, metrics.extent(errors)[0]
        counted = self.counted and self.counted.values
        return (counted.tried, counted.least) if counted else (None, None)

    @property
    def hits(self) -> metrics.Share | None:
        """The share of consecutive steps that converged."""
        if self.converged is None:
            return None
        solved = [outcome for outcome in Outcome if outcome.solved]
        return metrics.share(np.isin(self.converged.values.outcome, solved))

    def spread(self, name: str) -> Sequence[float | None]:
        """Return median, 95th percentile and largest iterations or residual of converged steps."""
        return spread_of(self.converged, name) if self.converged else (None, None, None)

    @property
    def at_floor(self) -> int | None:
        """Converged steps that ended at the rounding floor."""
        return int(self.converged.values.at_floor.sum()) if self.converged else None


def convergence(results: Results) -> list[Convergence]:
    """Return how every solver converges, cloth by cloth."""
    rows: dict[tuple[str, str], Convergence] = {}
    for task in (ONE_STEP, FEW, SWING, NEEDED):
        for record in results.all("cloth", task=task):
            place = _cloth(record), label(record.solver)
            row = rows.get(place, Convergence(*place, None, None, {}, None))
            rows[place] = _joined(row, task, record)
    cloths = list(dict.fromkeys(cloth for cloth, _ in rows))
    return sorted(rows.values(), key=lambda row: cloths.index(row.cloth))


def _cloth(record: Record) -> str:
    if record.facts["task"] != NEEDED:
        return f"lab cloth, {record.title}"
    size, stiffness = record.details.size, words(int(record.details.stiffness))
    return f"falling cloth, {stiffness} N/m, {size} × {size}"


def _joined(row: Convergence, task: str, record: Record) -> Convergence:
    if task == FEW:
        return row._replace(few={**row.few, record.details.iterations: _few(record)})
    field = {ONE_STEP: "one_step", SWING: "converged", NEEDED: "counted"}[task]
    changes: dict[str, Any] = {field: record}
    return row._replace(**changes)


def _few(record: Record) -> FewIterations:
    steps: values.FewIterations = record.values
    errors, drift = metrics.spread(steps.error), float(steps.drift[-1])
    share = metrics.ratio(drift, float(steps.path[-1]))
    return FewIterations(record, errors.median, errors.largest, drift, share)


class DampedStep(NamedTuple):
    """One step of a cloth with dampers.

    Attributes:
        record: what was measured.
        h: the length of the step [s].
        difference: of the two laws' forces at its end, relative.
        order: observed from the step twice as long, None at the first.
    """

    record: Record
    h: float
    difference: float
    order: float | None


def damped_steps(results: Results) -> list[DampedStep]:
    """Return the steps of every damped cloth, the longest first."""
    steps = []
    for record in results.all("cloth", task=DAMPERS):
        h, apart = record.values.h, record.values.apart
        orders = [None, *np.log2(apart[:-1] / apart[1:]).tolist()]
        steps += list(map(DampedStep, [record] * h.size, h.tolist(), apart.tolist(), orders))
    return steps


def minimiser_distance(record: Record) -> float | None:
    """Return how near a minimiser is proven to be [m], None without a bound."""
    step: Certified = record.values
    return step.distance if np.isfinite(step.distance) else None


def bound(record: Record) -> str:
    """Return whether there is a bound, or why there is none."""
    details: CertifiedDetails = record.details
    return "yes" if record.values.covered else details.coverage.lower().replace("_", " ")


def shares_minimiser(record: Record) -> str:
    """Return whether the answer is proven to belong to Newton's minimiser."""
    if record.values.same:
        return "yes"
    return "no" if record.values.different else "not proven"


def is_solved(record: Record) -> bool:
    """Return whether a step came to its tolerance or to the rounding floor."""
    step: Certified = record.values
    return step.at_floor or step.residual <= record.details.tolerance
