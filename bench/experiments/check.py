"""The cross-check's claims against Pinocchio, MuJoCo, closed forms and invariants."""

from collections.abc import Iterator, Sequence
from functools import partial

from ..measure.block import Block, Measured, Scale
from ..measure.record import Record
from ..measure.values import Fact, Values


class ClaimValues(Values, frozen=True, kw_only=True):
    """The largest relative difference over the cases, its tolerance, and the displacement."""

    quantity: Fact[str] = ""  # as computed by us
    reason: Fact[str] = ""  # for the tolerance
    failure: Fact[str] = ""  # why the claim failed
    obstacle: Fact[str] = ""  # why the claim could not be checked
    cases: int
    difference: float
    tolerance: float
    moved: float
    holds: bool


KINDS = {"": ClaimValues}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every claim, whose number of cases is the same at every scale."""
    from plumbob.crosscheck.claims import CLAIMS

    for claim in CLAIMS.values():
        yield Block("check", claim.name, claim.counterpart, partial(evaluate, claim.name))


def evaluate(name: str) -> Measured:
    """Evaluate a claim; return its numbers and its sentences."""
    from plumbob.crosscheck.claims import run_claims

    (verdict,) = run_claims([name])
    claim = verdict.claim
    sentences = {
        "quantity": claim.quantity,
        "reason": claim.tolerance.reason,
        "failure": verdict.failure,
    }
    if claim.obstacle:
        return {**sentences, "obstacle": claim.obstacle}
    return {
        **sentences,
        "cases": verdict.cases,
        "difference": verdict.difference,
        "tolerance": claim.tolerance.value,
        "moved": verdict.displacement,
        "holds": verdict.holds,
    }


# What is shown.

from plumbob.reference.arguments import distinct_texts

from ..measure import metrics
from ..peers.catalogue import MUJOCO, PINOCCHIO
from ..tables.captions import Captions
from ..tables.columns import folded, of_numbers, text
from ..tables.results import counted, listed
from ..tables.table import NO_SUMMARY, Column, Summary, in_unit, words

# A claim against an engine names the engine in the description of a side.
ENGINES = (PINOCCHIO, MUJOCO)


def _verdict(record: Record) -> str:
    claim: ClaimValues = record.values
    if claim.obstacle:
        return f"not checked: {claim.obstacle}"
    if claim.holds:
        return "held"
    digits = distinct_texts(claim.difference, claim.tolerance, 2)
    excess = " by {}, more than {}".format(*digits) * (claim.difference > claim.tolerance)
    return f"MISSED: {claim.failure}{excess}"


COLUMNS = (
    text("claim", lambda record: record.problem),
    text("verdict", _verdict),
    *folded(text("our quantity", lambda record: record.values.quantity)),
    text("compared with", lambda record: record.solver),
    Column("cases", read=of_numbers(lambda claim: claim.cases)),
    Column("largest difference", read=of_numbers(lambda claim: claim.difference)),
    Column("tolerance", read=of_numbers(lambda claim: claim.tolerance)),
)


def _summary(records: Sequence[Record]) -> Summary:
    checked = [record for record in records if not record.values.obstacle]
    if not checked:
        return NO_SUMMARY
    unchecked = len(records) - len(checked)
    more = f"; {counted(unchecked, 'claim')} could not be checked" if unchecked else ""
    claims: list[ClaimValues] = [record.values for record in checked]
    failures = [record.problem for record in checked if not record.values.holds]
    used = max(metrics.ratio(claim.difference, claim.tolerance) for claim in claims)
    engines = sum(any(e in r.values.quantity + r.solver for e in ENGINES) for r in checked)
    return Summary(
        f"{len(checked) - len(failures)} of {len(checked)} claims held ({engines} against "
        f"{listed(ENGINES, 'or')}, {len(checked) - engines} against closed forms and invariants), "
        f"over {words(sum(claim.cases for claim in claims))} cases; "
        f"the largest difference is {words(in_unit(used, '%'))} % of its tolerance{more}.",
        tuple(f"Missed: {name}" for name in failures),
    )


verdicts = Captions(__file__).layout(
    "check", lambda results: results.all("check"), _summary, columns=COLUMNS
)

LAYOUTS = (verdicts,)
