"""The verdicts of the cross-check."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results
from ...presentation.tables import Column, Summary, Table, words


def verdicts(results: Results) -> Table:
    """Return the claims with their verdicts."""
    records = results.all("check")
    rows = [
        (
            record.problem,
            record.notes["ours"],
            record.solver,
            int(record.arrays["cases"]),
            float(record.arrays["difference"]),
            float(record.arrays["tolerance"]),
            "held" if record.arrays["held"] else f"MISSED: {record.notes['missed']}",
        )
        for record in records
    ]
    return Table(
        "check",
        "Claims held against Pinocchio and MuJoCo",
        (
            Column("claim", words=True),
            Column("what we compute", words=True),
            Column("held against", words=True),
            Column("cases"),
            Column("largest difference"),
            Column("tolerance"),
            Column("verdict", words=True),
        ),
        tuple(rows),
        shows="Differences are relative, to the reach, the largest force or whatever scale the "
        "claim's tolerance names. A claim holds only if something moved in each of its cases.",
        measured="Each quantity computed twice, by us and by an engine, on seeded random systems.",
        summary=_sentence(records),
    )


def _sentence(records: Sequence[Record]) -> Summary:
    if not records:
        return Summary()
    missed = [record.problem for record in records if not record.arrays["held"]]
    cases = sum(int(record.arrays["cases"]) for record in records)
    used = max(
        metrics.ratio(float(record.arrays["difference"]), float(record.arrays["tolerance"]))
        for record in records
    )
    return Summary(
        f"{len(records) - len(missed)} of {len(records)} claims held, over {words(cases)} cases; "
        f"the smallest margin used {words(metrics.percent(used, 1.0))} % of its tolerance.",
        tuple(f"Missed: {name}" for name in missed),
    )
