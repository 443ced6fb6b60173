"""Verdicts on the claims of the cross-check."""

from collections.abc import Sequence

from plumbob.reference.arguments import distinct_texts

from ...harness import metrics
from ...harness.record import Record
from ...peers.registry import MUJOCO, PINOCCHIO
from ...tables.captions import Captions
from ...tables.columns import folded, number, text
from ...tables.layout import Layout
from ...tables.results import listed
from ...tables.table import Summary, in_unit, words

# A claim against an engine names it in the description of one of its sides.
ENGINES = (PINOCCHIO, MUJOCO)


def _verdict(record: Record) -> str:
    claim = record.values
    if claim.held:
        return "held"
    digits = distinct_texts(claim.difference, claim.tolerance, 2)
    excess = " by {}, more than {}".format(*digits) * (claim.difference > claim.tolerance)
    return f"MISSED: {record.details.failure}{excess}"


def _summary(records: Sequence[Record]) -> Summary:
    failures = [record.problem for record in records if not record.values.held]
    cases = sum(record.values.cases for record in records)
    used = max(metrics.ratio(r.values.difference, r.values.tolerance) for r in records)
    engines = sum(any(e in r.details.quantity + r.solver for e in ENGINES) for r in records)
    return Summary(
        f"{len(records) - len(failures)} of {len(records)} claims held ({engines} against "
        f"{listed(ENGINES, 'or')}, {len(records) - engines} against closed forms and invariants), "
        f"over {words(cases)} cases; "
        f"the smallest margin used {words(in_unit(used, '%'))} % of its tolerance.",
        tuple(f"Missed: {name}" for name in failures),
    )


verdicts = Layout(
    **Captions(__file__).of("check"),
    subjects=lambda results: results.all("check"),
    columns=(
        text("claim", lambda record: record.problem),
        text("verdict", _verdict),
        *folded([text("our quantity", lambda record: record.details.quantity)]),
        text("compared with", lambda record: record.solver),
        number("cases"),
        number("largest difference", "difference"),
        number("tolerance"),
    ),
    summary=_summary,
)

LAYOUTS = (verdicts,)
