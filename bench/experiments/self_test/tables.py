"""Which known faults the judge catches and names, and whom it accuses."""

from collections import Counter
from collections.abc import Sequence
from functools import partial

from ...harness.record import Record
from ...harness.results import Results
from ...tables.columns import folded, number, text, titled
from ...tables.layout import Layout
from ...tables.table import Column, Summary

Group = tuple[str, list[Record]]
# So many laws have a column of their own, those that most faults break.
MOST_LAWS = 12


def _groups(results: Results) -> list[Group]:
    groups: dict[str, list[Record]] = {}
    for record in results.all("self_test"):
        groups.setdefault(str(record.facts["family"]), []).append(record)
    return list(groups.items())


def _count(group: Group, name: str) -> int | None:
    records = [record for record in group[1] if record.facts["faulty"]]
    return sum(bool(record.arrays[name]) for record in records) if records else None


def _accused(group: Group) -> int | None:
    records = [record for record in group[1] if not record.facts["faulty"]]
    return sum(not record.arrays["passed"] for record in records) if records else None


def _summary(groups: Sequence[Group]) -> Summary:
    records = [record for _, members in groups for record in members]
    faulty = [record for record in records if record.facts["faulty"]]
    caught = sum(bool(record.arrays["caught"]) for record in faulty)
    named = sum(bool(record.arrays["named"]) for record in faulty)
    honest = [record for record in records if not record.facts["faulty"]]
    accused = [record for record in honest if not record.arrays["passed"]]
    return Summary(
        f"{caught} of {len(faulty)} planted faults caught, {named} named; "
        f"{len(accused)} of {len(honest)} honest solvers accused.",
        tuple(
            f"{record.facts['family']}: {record.title}"
            for record in records
            if not record.arrays["passed"]
        ),
    )


self_test = Layout(
    "Does the judge of solvers find what is wrong, and only that?",
    "self_test",
    "Planted faults and honest solvers, judged by plumbob verify",
    subjects=_groups,
    columns=(
        text("solvers", lambda group: group[0]),
        Column("tried", read=lambda group: len(group[1])),
        Column("faults caught", read=partial(_count, name="caught")),
        Column("faults named", read=partial(_count, name="named")),
        Column("wrongly accused", read=_accused),
    ),
    shows="Caught: a law is broken that knows nothing of faults. Named: the fault, or a class "
    "with it that no answer tells apart, is the first explanation.",
    measured="Each fault planted in the textbook’s method or the dense step, and judged as any "
    "solver is; honest are the reference, engines, single precision and other models of the step.",
    summary=_summary,
)


def _faults(results: Results) -> list[Record]:
    return [record for record in results.all("self_test") if record.facts["faulty"]]


def _matrix(records: Sequence[Record]) -> list[Column]:
    broken = Counter(law for record in records for law in record.facts["laws"])
    return [
        text("solvers", lambda record: str(record.facts["family"])),
        titled("fault"),
        number("named"),
        *folded(_law(law) for law, _ in broken.most_common(MOST_LAWS)),
    ]


def _law(law: str) -> Column:
    return text(law, lambda record: "×" if law in record.facts["laws"] else "")


faults = Layout(
    "Which law catches which fault?",
    "self_test_faults",
    "Laws that each planted fault breaks",
    subjects=_faults,
    columns=_matrix,
    shows="Each row is a fault, each cross a law that it breaks.",
    measured=f"The {MOST_LAWS} laws that most faults break; a fault without a cross breaks others.",
)

LAYOUTS = (self_test, faults)
