"""The cross-check's claims, a block each."""

from collections.abc import Iterator
from functools import partial

from plumbob.crosscheck.claims import CLAIMS, run_claims

from ...harness.block import Block, Measured, Scale


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every claim, whose number of cases is the same at every scale."""
    for claim in CLAIMS.values():
        yield Block("check", claim.name, claim.counterpart, partial(evaluate, claim.name))


def evaluate(name: str) -> Measured:
    """Evaluate a claim; return its numbers and its sentences."""
    (verdict,) = run_claims([name])
    claim = verdict.claim
    words = {
        "quantity": claim.quantity,
        "reason": claim.tolerance.reason,
        "failure": verdict.failure,
    }
    if claim.obstacle:
        return {**words, "obstacle": claim.obstacle}
    return {
        **words,
        "cases": verdict.cases,
        "difference": verdict.difference,
        "tolerance": claim.tolerance.value,
        "moved": verdict.displacement,
        "holds": verdict.holds,
    }
