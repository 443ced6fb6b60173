"""The cost of factors and steps as cloths grow to a million particles."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...peers import catalogue
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.table import NO_SUMMARY, Summary, words

CAPTIONS = Captions(__file__)
LABELS = {library.name: library.label for library in catalogue.FACTORS}


def _row(record: Record) -> Row:
    """Return medians and their ratios; a cell not measured is None."""
    medians = {name: metrics.spread(array).median for name, array in record.measured.items()}
    medians["particles"] = float(record.values.particles)
    if "step" in medians:
        medians["iteration"] = medians["step"] / record.values.iterations

    def relative(name: str, divisor: str) -> float | None:
        present = name in medians and divisor in medians
        return metrics.ratio(medians[name], medians[divisor]) if present else None

    return {
        "record": record,
        "particles": record.values.particles,
        "library": LABELS.get(record.solver, record.solver),
        "first factor": medians.get("factor"),
        "second factor": medians.get("refactor"),
        "solve": medians.get("solve"),
        "peak memory": medians.get("memory"),
        "iteration per particle": relative("iteration", "particles"),
        "iteration relative to a plain read": relative("iteration", "limit"),
        "final residual": medians.get("residual"),
        "all iterations": medians.get("step"),
        "all iterations relative to a solve": relative("step", "solve"),
        "local step per particle": relative("local", "particles"),
        "solve per particle": relative("solve", "particles"),
        "solve per nonzero": relative("solve", "entries"),
        "nonzeros of L per particle": relative("entries", "particles"),
    }


def _summary(rows: Sequence[Row]) -> Summary:
    steps = [row for row in rows if row["all iterations"] is not None]
    if not steps:
        return NO_SUMMARY
    row = max(steps, key=lambda row: int(row["particles"]))
    return Summary(
        f"With {words(row['particles'])} particles {words(row['record'].values.iterations)} "
        f"iterations take {words(row['all iterations'])} s, as long as "
        f"{words(row['all iterations relative to a solve'])} solves; the residual after them is "
        f"{words(row['final residual'])}."
    )


scale = CAPTIONS.layout(
    "cloth_scale", lambda results: map(_row, results.all("cloth_scale")), _summary
)

LAYOUTS = (scale,)
