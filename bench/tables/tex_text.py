"""Texts as data for TeX: escapes for what it takes for an instruction, and how wide texts are."""

import functools
import re
import unicodedata

from ..text import chunks
from .table import POWER

# A column of words may be as narrow as this, in units of its size.
NARROW = 4.0
# Between letters that TeX would join.
_LIGATURE = re.compile(r"(?<=-)(?=-)|(?<=')(?=')|(?<=,)(?=,)")
_SPECIAL = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "[": "{[}",  # else an option of the end of the row before
    "]": "{]}",
    "*": "{*}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\ensuremath{<}",
    ">": r"\ensuremath{>}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    "`": r"\textasciigrave{}",
    "–": r"\textendash{}",
    "−": r"\textminus{}",
    "“": r"\textquotedblleft{}",
    "”": r"\textquotedblright{}",
    "’": r"\textquoteright{}",
    "…": r"\dots{}",
    "µ": r"\textmu{}",
    "°": r"\textdegree{}",
    "¹": r"\textonesuperior{}",
    "²": r"\texttwosuperior{}",
    "³": r"\textthreesuperior{}",
    "⁻": r"\raisebox{0.6ex}{-}",
    "×": r"\texttimes{}",
    "±": r"\textpm{}",
    "·": r"\textperiodcentered{}",
    "≤": r"\ensuremath{\leq}",
    "≥": r"\ensuremath{\geq}",
    "→": r"\textrightarrow{}",
    "ß": r"\ss{}",
    "æ": r"\ae{}",
    "ø": r"\o{}",
    "ł": r"\l{}",
    "Æ": r"\AE{}",
    "Ø": r"\O{}",
    "Ł": r"\L{}",
}
_LETTERS = """alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma
tau upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"""


def _greek(name: str) -> str:
    """Return a Greek letter by its name in TeX."""
    size = "SMALL" if name.islower() else "CAPITAL"
    return unicodedata.lookup(f"GREEK {size} LETTER {name.upper().replace('LAMBDA', 'LAMDA')}")


_SPECIAL |= {_greek(name): rf"\ensuremath{{\{name}}}" for name in _LETTERS.split()}
# Accents by the name of the combining character.
_ACCENTS = {
    "\u0300": "`", "\u0301": "'", "\u0302": "^", "\u0303": "~", "\u0304": "=", "\u0306": "u",
    "\u0307": ".", "\u0308": '"', "\u030a": "r", "\u030b": "H", "\u030c": "v", "\u0327": "c",
}  # fmt: skip
# Widths of Latin Modern at 8 points, in thousandths of its size; at 9 and 10 it is narrower.
_GLYPHS = {
    295: "!',.:;[]`|il", 325: "fj", 354: "-  ", 383: "I°", 414: "()tr", 419: "s", 472: "cez",
    502: '"?', 531: "$*/\\{}0123456789ago–", 561: "J^~kqvxy", 590: "bdhnpuSµ", 664: "ZL",
    752: "FPEB", 767: "wCT", 796: "R_AHNUVXY", 834: "D&+<=>@OQGK−×", 885: "#%m",
    973: "M", 1091: "W",
}  # fmt: skip
_WIDE = {letter: width / 1000.0 for width, letters in _GLYPHS.items() for letter in letters}
_WIDEST, _BOLDER = 1.1, 1.2


@functools.lru_cache(maxsize=10_000)
def wide(text: str, bold: bool = False) -> float:
    """Return how wide a text is, in units of its size."""
    return (_BOLDER if bold else 1.0) * sum(_WIDE.get(letter, _WIDEST) for letter in _shown(text))


def _shown(text: str) -> str:
    """Return a text with what cannot be typeset everywhere written as an escape."""
    spaced = " ".join(text.split())
    if spaced.isascii() and spaced.isprintable():
        return spaced
    return "".join(map(_written, spaced))


def _written(letter: str) -> str:
    if letter in _SPECIAL or (letter.isascii() and letter.isprintable()) or _accented(letter):
        return letter
    return letter.encode("unicode_escape").decode()


def _accented(letter: str) -> str:
    """Return a letter with an accent in TeX's manner, "" if it is none."""
    base, *marks = list(unicodedata.normalize("NFD", letter))
    if len(marks) == 1 and marks[0] in _ACCENTS and base.isascii() and base.isalpha():
        return rf"\{_ACCENTS[marks[0]]}{{{base}}}"
    return ""


def escaped(text: str) -> str:
    """Return a text as data for TeX."""
    apart = _LIGATURE.sub("\0", _shown(text))
    return "".join(_tex(letter) for letter in apart)


def _tex(letter: str) -> str:
    if letter == "\0":
        return "{}"
    return _SPECIAL.get(letter) or (letter if letter.isascii() else _accented(letter))


def breakable(text: str, most: float) -> str:
    """Return a text as data for TeX; words wider than this, in units of its size, may be broken."""
    return " ".join(_word(token, most) for token in text.split())


def _word(token: str, most: float) -> str:
    if wide(token) <= most:
        return _with_powers(token)
    limit = min(most, 2 * NARROW) / 2
    return r"\hspace{0pt}".join(
        escaped(piece)
        for chunk in chunks(token)
        for piece in ([chunk] if wide(chunk) <= most else _pieces(_shown(chunk), limit))
    )


def _with_powers(token: str) -> str:
    """Return a word in which numbers such as 1.2e-5 are set as such."""
    begin, *others = POWER.split(token)
    powers = zip(others[::3], others[1::3], others[2::3], strict=True)
    return escaped(begin) + "".join(rf"\num{{{x}e{n}}}{escaped(t)}" for x, n, t in powers)


def fragments(text: str) -> list[str]:
    """Return what a line of a heading may be made of: words with a space, parts of long ones."""
    found: list[str] = []
    for token in text.split():
        parts = [token] if wide(token) <= 2 * NARROW else chunks(token)
        pieces = [p for part in parts for p in _pieces(_shown(part), 2 * NARROW)]
        found += [*pieces[:-1], f"{pieces[-1]} "]
    return found


def _pieces(word: str, most: float) -> list[str]:
    pieces = [""]
    for letter in word:
        if pieces[-1] and wide(pieces[-1] + letter) > most:
            pieces.append("")
        pieces[-1] += letter
    return pieces
