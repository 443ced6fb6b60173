"""Text as data for TeX: no name is read as an instruction."""

import re
import unicodedata

from plumbob.text.printable import chunks

from .writers import POWER

# Between letters that TeX would join.
_LIGATURE = re.compile(r"(?<=-)(?=-)|(?<=')(?=')|(?<=,)(?=,)|(?<=[?!])(?=`)|(?<=[<>])(?=[<>])")
_SPECIAL = {
    "\0": "{}",
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
# Letters that LaTeX has read as they are since 2020, beside letters with accents.
_PLAIN = set("–“”‘’…µ°¹²³×±·→")
_LAST_LATIN = 0x17F
# Greek capital letters that do not look like Latin ones.
_CAPITALS = {"GAMMA", "DELTA", "THETA", "LAMDA", "PI", "SIGMA", "PHI", "PSI", "OMEGA", "XI"}


def escaped(text: str) -> str:
    """Return a text as data for TeX; a letter that not every TeX has becomes a Python escape."""
    return "".join(map(_letter, _LIGATURE.sub("\0", " ".join(text.split()).replace("\0", "␀"))))


def _letter(letter: str) -> str:
    if letter in _SPECIAL:
        return _SPECIAL[letter]
    is_latin = letter.isalpha() and ord(letter) <= _LAST_LATIN
    if is_latin or letter in _PLAIN or (letter.isascii() and letter.isprintable()):
        return letter
    case, _, name = unicodedata.name(letter, "").removeprefix("GREEK ").partition(" LETTER ")
    if name.isalpha() and (case == "SMALL" or (case == "CAPITAL" and name in _CAPITALS)):
        name = name.lower() if case == "SMALL" else name.capitalize()
        return rf"\ensuremath{{\{name.replace('amda', 'ambda')}}}"
    return "".join(map(_letter, letter.encode("unicode_escape").decode()))


def breakable(text: str) -> str:
    """Return a text as data for TeX: long words may be broken, numbers such as 1.2e-5 are set."""
    return " ".join(map(_word, text.split()))


def _word(token: str) -> str:
    if not POWER.search(token):
        return r"\hspace{0pt}".join(escaped(part) for part in word_parts(token))
    first, *parts = POWER.split(token)
    powers = zip(parts[::3], parts[1::3], parts[2::3], strict=True)
    return escaped(first) + "".join(rf"\num{{{x}e{n}}}{escaped(text)}" for x, n, text in powers)


def word_parts(token: str, longest: int = 12) -> list[str]:
    """Return the parts of a word between which a line may end, at most so many letters long."""
    return [part[i : i + longest] for part in chunks(token) for i in range(0, len(part), longest)]
