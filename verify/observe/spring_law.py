"""The law of one spring, measured over stretch and compression: what it pulls at each length."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..exchange import Answer
from ..judgement import CaseJudgement
from ..mass_spring.problem import frames, problem_of
from .fits import RIGHT, Term, formula
from .separation import TOLERANCE, words_of

# What springs pull by other laws (see `words.toml`), by stiffness k, length l and rest length r.
LAWS: Mapping[str, Any] = {
    "k l (l²/r² - 1)/2": lambda s: 0.5 * s.k * s.l * (s.l**2 / s.r**2 - 1.0),
    "k r (l²/r² - 1)/2": lambda s: 0.5 * s.k * s.r * (s.l**2 / s.r**2 - 1.0),
    "k l (l² - r²)": lambda s: s.k * s.l * (s.l**2 - s.r**2),
    "k (l² - r²)": lambda s: s.k * (s.l**2 - s.r**2),
    "k r log(l/r)": lambda s: s.k * s.r * np.log(s.l / s.r),
    "k log(l/r)": lambda s: s.k * np.log(s.l / s.r),
    "k r²/l log(l/r)": lambda s: s.k * s.r**2 / s.l * np.log(s.l / s.r),
    "k (l/r - 1)": lambda s: s.k * (s.l / s.r - 1.0),
    "k l (l - r)": lambda s: s.k * s.l * (s.l - s.r),
    "k (l - r)²": lambda s: s.k * (s.l - s.r) * np.abs(s.l - s.r),
    "k max(l - r, 0)": lambda s: s.k * np.maximum(s.l - s.r, 0.0),
}
# The energies of these laws.
ENERGIES: Mapping[str, Any] = {
    "k r² (l²/r² - 1)²/8": lambda s: s.k * s.r**2 * (s.l**2 / s.r**2 - 1.0) ** 2 / 8.0,
    "k (l² - r²)²/4": lambda s: s.k * (s.l**2 - s.r**2) ** 2 / 4.0,
    "k r² log(l/r)²/2": lambda s: 0.5 * s.k * s.r**2 * np.log(s.l / s.r) ** 2,
    "k log(l/r)²/2": lambda s: 0.5 * s.k * np.log(s.l / s.r) ** 2,
    "k (l/r - 1)²/2": lambda s: 0.5 * s.k * (s.l / s.r - 1.0) ** 2,
    "k max(l - r, 0)²/2": lambda s: 0.5 * s.k * np.maximum(s.l - s.r, 0.0) ** 2,
    "k l²/2": lambda s: 0.5 * s.k * s.l**2,
}
# A law is measured at so many lengths, of stretched and of compressed springs.
MIN_LENGTHS = 6
# Longer springs would hide the shape of the law near rest, where most springs are.
LONGEST_DRAWN = 2.0


class SpringLaw(NamedTuple):
    """What springs pull at their lengths over k r, or their energies over k r²."""

    stretches: FloatArray  # l/r, ascending
    measured: FloatArray
    linear: FloatArray  # of right springs, l/r - 1 or (l/r - 1)²/2


def law_words(
    pulls: FloatArray, terms: Mapping[str, FloatArray], elastic: BoolArray, count: Mapping[str, Any]
) -> Sentence | None:
    """Return which law springs follow, None if it is the linear law or none that is known.

    `terms` are those of pulls, and `elastic` tells springs without dampers. A law is known up to a
    factor.
    """
    k = terms["k"]
    elastic = elastic & (k > 0.0) & (terms["k r"] > 0.0)
    pulls, k = pulls[elastic], k[elastic]
    s = SimpleNamespace(k=k, l=terms["k l"][elastic] / k, r=terms["k r"][elastic] / k)
    match = _match(pulls, s, LAWS)
    if match is None:
        return None
    return sentence(
        "Its springs follow another law: {law}. Each pulls {formula} {place}; right is k (l - r) "
        "(k: stiffness, l: length, r: rest length; {count} springs of {cases} cases, solved from "
        "the answers).",
        law=words_of("law", match.symbol), formula=formula([match]),
        curve=_curve(pulls / (k * s.r), s.l / s.r, s.l / s.r - 1.0),
        **{**count, "count": len(k)})  # fmt: skip


def energy_law(judgements: Sequence[CaseJudgement]) -> Sentence | None:
    """Return which law the answered energies of single springs follow, None if a right or none."""
    problems = [(problem_of(j.case.inputs), j.answer) for j in judgements]
    single = [
        (p, float(answer.values["elastic"]))
        for p, answer in problems
        if isinstance(answer, Answer) and "elastic" in answer.values and len(p.springs) == 1
    ]
    single = [(p, energy) for p, energy in single if p.stiff and p.rest_lengths[0]]
    values = np.array([energy for _, energy in single])
    if not values.any():
        return None
    k, r = (
        np.array([getattr(p, n)[0] for p, _ in single]) for n in ("stiffnesses", "rest_lengths")
    )
    s = SimpleNamespace(k=k, r=r, l=np.array([frames(p, p.positions)[0][0] for p, _ in single]))
    match = _match(values, s, ENERGIES)
    if match is None:
        return None
    stretches = s.l / s.r
    return sentence(
        "Its springs follow another law: the elastic energy of each is {formula}; right is "
        "k (l - r)²/2 (k: stiffness, l: length, r: rest length; {count} cases of one spring).",
        formula=formula([match]), count=len(k),
        curve=_curve(values / (k * r**2), stretches, 0.5 * (stretches - 1.0) ** 2),
    )  # fmt: skip


def _match(values: FloatArray, springs: Any, laws: Mapping[str, Any]) -> Term | None:
    """Return the law of springs k, l, r that has some values, with a factor; None if none has."""
    is_both = bool((springs.l > springs.r).any() and (springs.l < springs.r).any())
    for symbol, rule in laws.items() if is_both and len(values) >= MIN_LENGTHS else ():
        column = rule(springs)
        factor = float(column @ values / (column @ column))
        if np.abs(values - factor * column).max() <= TOLERANCE * np.abs(values).max():
            return Term(1.0 if abs(factor - 1.0) <= RIGHT else factor, symbol)
    return None


def _curve(measured: FloatArray, stretches: FloatArray, linear: FloatArray) -> SpringLaw:
    order = np.argsort(stretches)
    shown = order[stretches[order] <= LONGEST_DRAWN]
    order = shown if len(shown) >= MIN_LENGTHS else order
    return SpringLaw(stretches[order], measured[order], linear[order])


def law_in(observations: Sequence[Sentence]) -> SpringLaw | None:
    """Return the first measured law that observations tell of."""
    curves = (words.values.get("curve") for words in observations)
    return next((curve for curve in curves if isinstance(curve, SpringLaw)), None)
