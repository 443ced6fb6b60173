"""Texts as data for TeX: nothing in a name is taken for an instruction."""

import re
import unicodedata

from ..text import chunks
from .table import POWER

# Between letters that TeX would join.
_LIGATURE = re.compile(r"(?<=-)(?=-)|(?<=')(?=')|(?<=,)(?=,)|(?<=[?!])(?=`)|(?<=[<>])(?=[<>])")
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "[": "{[}",  # else an option of the end of the row before
    "]": "{]}",
    "*": "{*}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    "`": r"\textasciigrave{}",
    "−": r"\textminus{}",
    "⁻": r"\raisebox{0.6ex}{-}",
    "≤": r"\ensuremath{\leq}",
    "≥": r"\ensuremath{\geq}",
    "∞": r"\ensuremath{\infty}",
} | {letter: f"\\{letter}" for letter in "{}$&#%_"}
# What LaTeX reads as it is since 2020, beside letters with accents.
_READ = set("–“”‘’…µ°¹²³×±·→")
_LAST_LATIN = 0x17F


def escaped(text: str) -> str:
    """Return a text as data for TeX; a letter that not every TeX has becomes a Python escape."""
    return "".join(map(_letter, _LIGATURE.sub("\0", " ".join(text.split()).replace("\0", "␀"))))


def _letter(letter: str) -> str:
    if letter == "\0":
        return "{}"
    if letter in _SPECIAL:
        return _SPECIAL[letter]
    if (letter.isascii() and letter.isprintable()) or letter in _READ:
        return letter
    if letter.isalpha() and ord(letter) <= _LAST_LATIN:
        return letter
    size, _, name = unicodedata.name(letter, "").removeprefix("GREEK ").partition(" LETTER ")
    if name.isalpha() and (size == "SMALL" or (size == "CAPITAL" and name in _CAPITALS)):
        name = name.lower() if size == "SMALL" else name.capitalize()
        return rf"\ensuremath{{\{name.replace('amda', 'ambda')}}}"
    return "".join(map(_letter, letter.encode("unicode_escape").decode()))


# The capital letters that do not look like Latin ones.
_CAPITALS = {"GAMMA", "DELTA", "THETA", "LAMDA", "PI", "SIGMA", "PHI", "PSI", "OMEGA", "XI"}


def breakable(text: str) -> str:
    """Return a text as data for TeX: long words may be broken, numbers such as 1.2e-5 are set."""
    return " ".join(_word(token) for token in text.split())


def _word(token: str) -> str:
    if POWER.search(token):
        begin, *others = POWER.split(token)
        powers = zip(others[::3], others[1::3], others[2::3], strict=True)
        return escaped(begin) + "".join(rf"\num{{{x}e{n}}}{escaped(t)}" for x, n, t in powers)
    return r"\hspace{0pt}".join(escaped(piece) for piece in pieces(token))


def pieces(token: str, longest: int = 12) -> list[str]:
    """Return the parts of a word between which a line may end, none longer than so many letters."""
    return [part[i : i + longest] for part in chunks(token) for i in range(0, len(part), longest)]
