"""Verdicts on the claims of the cross-check."""

from collections.abc import Sequence

from plumbob.reference.arguments import distinct_texts

from ...harness import metrics
from ...harness.record import Record
from ...peers.catalogue import MUJOCO, PINOCCHIO
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import counted, listed
from ...tables.table import NO_SUMMARY, Summary, in_unit, words

# A claim against an engine names the engine in the description of a side.
ENGINES = (PINOCCHIO, MUJOCO)


def _row(record: Record) -> Row:
    claim, details = record.values, record.values
    row = {
        "record": record,
        "claim": record.problem,
        "our quantity": details.quantity,
        "compared with": record.solver,
    }
    if details.obstacle:
        numbers = dict.fromkeys(("cases", "largest difference", "tolerance"))
        return {**row, "verdict": f"not checked: {details.obstacle}", **numbers}
    digits = distinct_texts(claim.difference, claim.tolerance, 2)
    excess = " by {}, more than {}".format(*digits) * (claim.difference > claim.tolerance)
    return {
        **row,
        "verdict": "held" if claim.holds else f"MISSED: {details.failure}{excess}",
        "cases": claim.cases,
        "largest difference": claim.difference,
        "tolerance": claim.tolerance,
    }


def _summary(all_rows: Sequence[Row]) -> Summary:
    rows = [row for row in all_rows if row["cases"] is not None]
    if not rows:
        return NO_SUMMARY
    unchecked = len(all_rows) - len(rows)
    more = f"; {counted(unchecked, 'claim')} could not be checked" if unchecked else ""
    failures = [row["claim"] for row in rows if row["verdict"] != "held"]
    used = max(metrics.ratio(row["largest difference"], row["tolerance"]) for row in rows)
    engines = sum(
        any(e in row["our quantity"] + row["compared with"] for e in ENGINES) for row in rows
    )
    return Summary(
        f"{len(rows) - len(failures)} of {len(rows)} claims held ({engines} against "
        f"{listed(ENGINES, 'or')}, {len(rows) - engines} against closed forms and invariants), "
        f"over {words(sum(row['cases'] for row in rows))} cases; "
        f"the largest difference is {words(in_unit(used, '%'))} % of its tolerance{more}.",
        tuple(f"Missed: {name}" for name in failures),
    )


verdicts = Captions(__file__).layout(
    "check", lambda results: map(_row, results.all("check")), _summary
)

LAYOUTS = (verdicts,)
