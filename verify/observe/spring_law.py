"""The law of one spring, measured over stretch and compression: what it pulls at each length."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

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
# A law is measured at so many lengths, of stretched and of compressed springs.
MIN_LENGTHS = 6


class SpringLaw(NamedTuple):
    """What springs pull at their lengths; a right spring pulls l/r - 1 in these units."""

    stretches: FloatArray  # l/r, ascending
    pulls: FloatArray  # over k r


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
    is_both = bool((s.l > s.r).any() and (s.l < s.r).any())
    for symbol, rule in LAWS.items() if is_both and len(k) >= MIN_LENGTHS else ():
        values = rule(s)
        factor = float(values @ pulls / (values @ values))
        if np.abs(pulls - factor * values).max() <= TOLERANCE * np.abs(pulls).max():
            factor = 1.0 if abs(factor - 1.0) <= RIGHT else factor
            order = np.argsort(s.l / s.r)
            curve = SpringLaw((s.l / s.r)[order], (pulls / (k * s.r))[order])
            return sentence(
                "Its springs follow another law: {law}. Each pulls {formula} {place}; right is "
                "k (l - r) (k: stiffness, l: length, r: rest length; {count} springs of {cases} "
                "cases, solved from the answers).",
                law=words_of("law", symbol), formula=formula([Term(factor, symbol)]), curve=curve,
                **{**count, "count": len(k)})  # fmt: skip
    return None


def law_in(observations: Sequence[Sentence]) -> SpringLaw | None:
    """Return the first measured law that observations tell of."""
    curves = (words.values.get("curve") for words in observations)
    return next((curve for curve in curves if isinstance(curve, SpringLaw)), None)
