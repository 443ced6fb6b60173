"""Which planted faults `plumbob verify` catches and names, and which honest solvers it accuses."""

from collections.abc import Sequence

from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import text, titled
from ...tables.layout import Layout
from ...tables.results import grouped, listed
from ...tables.table import Column, Summary


def _is_accused(record: Record) -> bool | None:
    """Return whether an honest solver is accused, None of a faulty one."""
    return None if record.details.faulty else not record.values.passed


def _summary(records: Sequence[Record]) -> Summary:
    families = grouped(records, lambda record: record.details.family)
    failures = [f"{r.details.family}: {r.title}" for r in records if not r.values.passed]
    points = (f"{family}: {_counts(members)}" for family, members in families.items())
    return Summary(f"{_counts(records)}:", (*failures, *points))


def _counts(records: Sequence[Record]) -> str:
    """Return how many faults are caught and named, and how many honest solvers are accused."""
    faults = [record.values for record in records if record.details.faulty]
    caught, named = sum(f.caught for f in faults), sum(f.named for f in faults)
    accused = sum(bool(_is_accused(record)) for record in records)
    planted = f"{caught} of {len(faults)} planted faults caught, {named} named"
    honest = f"{accused} of {len(records) - len(faults)} honest solvers accused"
    return "; ".join([planted] * bool(faults) + [honest] * (len(faults) < len(records)))


self_test = Layout(
    **Captions(__file__).of("self_test"),
    subjects=lambda results: results.all("self_test"),
    columns=(
        text("solvers", lambda record: record.details.family),
        titled("fault or honest solver"),
        Column("caught", read=lambda r: r.values.caught if r.details.faulty else None),
        Column("named", read=lambda r: r.values.named if r.details.faulty else None),
        Column("accused", read=_is_accused),
        text("violated laws", lambda record: listed(record.details.laws)),
    ),
    summary=_summary,
)

LAYOUTS = (self_test,)
