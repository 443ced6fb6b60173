"""How often, and how closely, every solver meets its target within reach."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, label, problems, settings, solvers
from ...presentation.tables import INTERVAL, Cell, Column, Summary, Table, words
from ..chain import BEYOND, CHAIN
from . import CURVE


def accuracy(results: Results) -> Table:
    """Return success and residuals of every solver on every problem within reach."""
    records = results.all("arm", task=CURVE, warm=False)
    records += results.all("arm", task=CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.facts["stratum"] != BEYOND]
    order = problems(records)
    records.sort(key=lambda record: order.index(record.problem))
    return Table(
        "accuracy",
        "Success and residuals within reach",
        (
            Column("problem", words=True),
            Column("solver", words=True),
            Column("start", words=True),
            Column("within tolerance", note=INTERVAL),
            Column("residual, median", "m"),
            Column("residual, 95 %", "m"),
            Column("residual, largest", "m"),
            Column("iterations, median"),
            Column("iterations, 95 %"),
            Column("iterations, largest"),
        ),
        tuple(_accuracy_row(record) for record in records),
        shows=f"A solve succeeds if the effector is within {settings(records, 'tolerance')} m of "
        "its target. Residuals are not cut off at the tolerance. The interval is Wilson’s.",
        measured="Residuals recomputed by forward kinematics of the rotations returned, whatever "
        "the solver says. Starts: the arm’s rest pose, the last frame’s solution, or seeded random "
        f"rotations. At most {settings(records, 'max_iterations')} iterations.",
        summary=_accuracy_summary(records),
    )


def _accuracy_row(record: Record) -> tuple[Cell, ...]:
    starts = {None: "random", False: "rest", True: "last solution"}
    return (
        record.title,
        label(record.solver),
        starts[record.settings.get("warm")],
        _success(record),
        *metrics.spread(record.arrays["residual"]),
        *metrics.whole(record.arrays["iterations"]),
    )


def _success(record: Record) -> metrics.Share:
    return metrics.share(record.arrays["residual"] <= record.settings["tolerance"])


def _accuracy_summary(records: Sequence[Record]) -> Summary:
    points = []
    for solver in solvers(records):
        shares = [_success(record) for record in records if record.solver == solver]
        hits, total = sum(share.hits for share in shares), sum(share.total for share in shares)
        points.append(f"{label(solver)}: {words(hits)} of {words(total)}")
    return Summary("Solved within tolerance, over all these problems:", tuple(points))
