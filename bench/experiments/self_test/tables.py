"""Which planted faults `plumbob verify` catches and names, and which honest solvers it accuses."""

from collections.abc import Sequence

from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import grouped, listed
from ...tables.table import Summary


def _row(record: Record) -> Row:
    """Return a row; an honest solver has no fault, and a faulty one is not accused."""
    trial, details = record.values, record.details
    return {
        "record": record,
        "solvers": details.family,
        "fault or honest solver": record.title,
        "caught": trial.caught if details.faulty else None,
        "named": trial.is_named if details.faulty else None,
        "accused": None if details.faulty else not trial.passed,
        "violated laws": listed(details.laws),
    }


def _summary(rows: Sequence[Row]) -> Summary:
    families = grouped(rows, lambda row: str(row["solvers"]))
    failures = [
        f"{row['solvers']}: {row['fault or honest solver']}"
        for row in rows
        if not row["record"].values.passed
    ]
    points = (f"{family}: {_counts(members)}" for family, members in families.items())
    return Summary(f"{_counts(rows)}.", (*failures, *points))


def _counts(rows: Sequence[Row]) -> str:
    """Return how many faults are caught and named, and how many honest solvers are accused."""
    faults = [row for row in rows if row["record"].details.faulty]
    caught, correct, accused = (
        sum(bool(row[title]) for row in rows) for title in ("caught", "named", "accused")
    )
    planted = f"{caught:,} of {len(faults):,} planted faults are caught and {correct:,} are named"
    honest = f"{accused} of {len(rows) - len(faults)} honest solvers are accused"
    return "; ".join([planted] * bool(faults) + [honest] * (len(faults) < len(rows)))


self_test = Captions(__file__).layout(
    "self_test", lambda results: map(_row, results.all("self_test")), _summary
)

LAYOUTS = (self_test,)
