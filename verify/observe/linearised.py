"""What springs pull in a linearised step, along and across them.

A step of two free particles tells the pull: in the difference of their accelerations gravity
cancels.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from .fits import Term, fit, formula, is_sum
from .pulls import SpringCase
from .separation import TOLERANCE

# Possible pulls of a spring along itself, by its stiffness k, length l, rest length r, and its
# lengthening e by the step, to first order. Then pulls across itself, for each unit of motion
# across.
ALONG = ("k l", "k r", "k e", "k r e/l", "k l²", "k r²", "k l³/r²", "k l² e/r²", "k")
ACROSS = ("k", "k r/l", "k l/r", "k l²/r²", "k r²/l²")
RIGHT_ALONG = {"k l": 1.0, "k r": -1.0, "k e": 1.0}
# The whole Hessian, the Hessian without its geometric term, or with k in all directions.
RIGHT_ACROSS: Sequence[Mapping[str, float]] = ({"k": 1.0, "k r/l": -1.0}, {}, {"k": 1.0})


class LinearPull(NamedTuple):
    """What the spring of a pair pulls in a step, and the possible terms of the pull."""

    along: float  # [N]
    across: float  # [N/m]
    along_terms: list[float]
    across_terms: list[float]


def linearised_pulls(cases: Sequence[SpringCase]) -> tuple[Sentence, bool] | None:
    """Return the pull of springs in a linearised step, and whether the pull is right.

    None stands for answers of another step.
    """
    pairs = [case for case in cases if _is_pair(case)]
    pulls = [pull for pull in map(_pull, pairs) if pull is not None]
    if not pulls or len(pulls) < len(pairs):
        return None
    along, across = (np.array([getattr(p, name) for p in pulls]) for name in ("along", "across"))
    terms, across_terms = (
        dict(zip(names, np.array([getattr(p, field) for p in pulls]).T, strict=True))
        for names, field in ((ALONG, "along_terms"), (ACROSS, "across_terms"))
    )
    sums = (
        fit(along, terms, 4),
        fit(np.where(abs(across) > TOLERANCE, across, 0.0), across_terms, 2),
    )
    if sums[0] is None or sums[1] is None or not any("e" in term.symbol for term in sums[0]):
        return None
    is_right = is_sum(sums[0], RIGHT_ALONG) and any(is_sum(sums[1], due) for due in RIGHT_ACROSS)
    words = sentence(
        "In its linearised step every spring pulls {along} along it, and {across} for each metre "
        "that its ends are moved across it; right are {right} and {right_across} (k: stiffness, l: "
        "length, r: rest length, e: what the step adds to l; {count} cases of one spring, solved "
        "from the answers).",
        along=formula(sums[0]), across=formula(sums[1]), right=_text(RIGHT_ALONG),
        right_across=_text(RIGHT_ACROSS[0]), count=len(pulls),
    )  # fmt: skip
    return words, is_right


def _text(coefficients: Mapping[str, float]) -> str:
    return formula([Term(number, symbol) for symbol, number in coefficients.items()])


def _is_pair(case: SpringCase) -> bool:
    """Return whether a case has two free particles with a stiff spring and no damper."""
    p = case.problem
    is_free = p.count == 2 and len(p.springs) == 1 and not len(p.pinned)
    if not is_free or case.end is None or p.damped or p.external.any():
        return False
    return bool(p.stiff and p.rest_lengths[0] and (p.incidence @ case.x).any())


def _pull(case: SpringCase) -> LinearPull | None:
    """Return what the spring of a pair pulls, None for a pull beside the motion of its ends."""
    p, incidence = case.problem, case.problem.incidence[0]
    assert case.end is not None
    d = incidence @ case.x
    length, r, k = float(np.linalg.norm(d)), float(p.rest_lengths[0]), float(p.stiffnesses[0])
    u, moved = d / length, incidence @ (case.end - case.x)
    acceleration = incidence @ (case.end - case.x - case.h * case.v) / case.h**2
    pull: FloatArray = -acceleration / float((1.0 / p.masses).sum())
    e = float(moved @ u)
    beside, pull_beside = moved - e * u, pull - (pull @ u) * u
    square = float(beside @ beside)
    across = float(pull_beside @ beside) / square if square else 0.0
    if np.abs(pull_beside - across * beside).max() > TOLERANCE * np.abs(pull).max():
        return None
    values = {
        "k l": k * length, "k r": k * r, "k": k, "k e": k * e, "k r e/l": k * r * e / length,
        "k l²": k * length**2, "k r²": k * r**2, "k l³/r²": k * length**3 / r**2,
        "k l² e/r²": k * length**2 * e / r**2, "k r/l": k * r / length, "k l/r": k * length / r,
        "k l²/r²": k * length**2 / r**2, "k r²/l²": k * r**2 / length**2,
    }  # fmt: skip
    along = float(pull @ u)
    return LinearPull(along, across, [values[s] for s in ALONG], [values[s] for s in ACROSS])
