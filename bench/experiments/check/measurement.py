"""The cross-check's claims, a block each."""

from collections.abc import Iterator
from functools import partial

from plumbob.crosscheck.claims import CLAIMS, run_claims

from ...harness.block import Block, Measured, Scale
from .values import ClaimValues


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every claim, whose number of cases is the same at every scale."""
    for claim in CLAIMS.values():
        yield Block("check", claim.name, claim.counterpart, partial(evaluate, claim.name))


def evaluate(name: str) -> Measured:
    """Evaluate a claim; return its numbers and its sentences."""
    (verdict,) = run_claims([name])
    claim = verdict.claim
    numbers = (verdict.cases, verdict.difference, claim.tolerance.value, verdict.displacement)
    notes = {"ours": claim.quantity, "reason": claim.tolerance.reason, "missed": verdict.failure}
    if claim.obstacle:
        return Measured(None, {**notes, "obstacle": claim.obstacle})
    return Measured(ClaimValues(*numbers, verdict.holds), notes)
