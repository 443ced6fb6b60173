"""The verdicts of the cross-check."""

from collections.abc import Sequence

from plumbob.reference.arguments import distinct_texts

from ...harness import metrics
from ...harness.record import Record
from ...peers.registry import MUJOCO, PINOCCHIO
from ...tables.columns import folded, number, text
from ...tables.layout import Layout
from ...tables.results import listed
from ...tables.table import Summary, in_unit, words

# The claims that rest on one name it in the words of either side.
ENGINES = (PINOCCHIO, MUJOCO)


def _verdict(record: Record) -> str:
    if record.values.held:
        return "held"
    difference, tolerance = record.values.difference, record.values.tolerance
    by = " by {}, more than {}".format(*distinct_texts(difference, tolerance, 2))
    return f"MISSED: {record.details.missed}{by if difference > tolerance else ''}"


def _summary(records: Sequence[Record]) -> Summary:
    missed = [record.problem for record in records if not record.values.held]
    cases = sum(record.values.cases for record in records)
    used = max(
        metrics.ratio(record.values.difference, record.values.tolerance) for record in records
    )
    engines = sum(any(e in r.details.ours + r.solver for e in ENGINES) for r in records)
    return Summary(
        f"{len(records) - len(missed)} of {len(records)} claims held ({engines} against "
        f"{listed(ENGINES, 'or')}, {len(records) - engines} against closed forms and invariants), "
        f"over {words(cases)} cases; "
        f"the smallest margin used {words(in_unit(used, '%'))} % of its tolerance.",
        tuple(f"Missed: {name}" for name in missed),
    )


verdicts = Layout(
    "Do Pinocchio and MuJoCo agree with the reference?",
    "check",
    "Claims against Pinocchio, MuJoCo, closed forms and invariants",
    subjects=lambda results: results.all("check"),
    columns=(
        text("claim", lambda record: record.problem),
        text("verdict", _verdict),
        *folded([text("what we compute", lambda record: record.details.ours)]),
        text("held against", lambda record: record.solver),
        number("cases"),
        number("largest difference", "difference"),
        number("tolerance"),
    ),
    shows="Differences are relative, to the reach, the largest force or whatever scale the "
    "claim's tolerance names. A claim holds only if something moved in each of its cases.",
    measured="Each quantity computed by us and as “held against” says, on seeded random systems.",
    summary=_summary,
)


LAYOUTS = (verdicts,)
