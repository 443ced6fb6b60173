"""Which known faults the judge catches and names, by which laws, and whom it accuses."""

from collections.abc import Sequence

from ...harness.record import Record
from ...tables.columns import text, titled
from ...tables.layout import Layout
from ...tables.results import listed
from ...tables.table import Cell, Column, Summary


def _of_fault(name: str, record: Record) -> Cell:
    """Return whether a fault is caught, or named; None of an honest solver."""
    return getattr(record.values, name) if record.details.faulty else None


def _is_accused(record: Record) -> bool | None:
    """Return whether an honest solver is accused, None of a faulty one."""
    return None if record.details.faulty else not record.values.passed


def _summary(records: Sequence[Record]) -> Summary:
    families = dict.fromkeys(record.details.family for record in records)
    failures = [f"{r.details.family}: {r.title}" for r in records if not r.values.passed]
    points = (f"{f}: {_count([r for r in records if r.details.family == f])}" for f in families)
    return Summary(f"{_count(records)}:", (*failures, *points))


def _count(records: Sequence[Record]) -> str:
    """Say how many faults are caught and named, and how many honest solvers are accused."""
    faulty = [record for record in records if record.details.faulty]
    caught, named = (
        sum(bool(getattr(r.values, name)) for r in faulty) for name in ("caught", "named")
    )
    accused = sum(bool(_is_accused(record)) for record in records)
    faults = f"{caught} of {len(faulty)} planted faults caught, {named} named"
    honest = f"{accused} of {len(records) - len(faulty)} honest solvers accused"
    return "; ".join([faults] * bool(faulty) + [honest] * (len(faulty) < len(records)))


self_test = Layout(
    "Does the judge of solvers find what is wrong, and only that?",
    "self_test",
    "Planted faults and honest solvers, judged by plumbob verify",
    subjects=lambda results: results.all("self_test"),
    columns=(
        text("solvers", lambda record: record.details.family),
        titled("fault or honest solver"),
        Column("caught", read=lambda record: _of_fault("caught", record)),
        Column("named", read=lambda record: _of_fault("named", record)),
        Column("accused", read=_is_accused),
        text("broken laws", lambda record: listed(record.details.laws)),
    ),
    shows="Caught: a law is broken that knows nothing of faults. Named: the fault, or a class "
    "with it that no answer tells apart, is the first explanation. Accused: an honest solver is "
    "called wrong, or a fault is named.",
    measured="Each fault planted in the textbook’s method or the dense step, and judged as any "
    "solver is; honest are the reference, engines, single precision and other models of the step.",
    summary=_summary,
)

LAYOUTS = (self_test,)
