"""A table as LaTeX: rules of booktabs, numbers aligned by siunitx, texts escaped.

The cells are the same as in Markdown. Widths, fonts and page breaks are set by the paper.
"""

import math
import re
from collections.abc import Sequence

from .table import Cell, Table, best_cells, words

_PREAMBLE = r"""% \usepackage[T1]{fontenc}
% \usepackage{booktabs,siunitx} % siunitx of 2021 or newer (version 3)"""
# Numbers look as in Markdown, bold numbers too.
_NUMBERS = r"""\sisetup{mode=text, reset-text-series=false, output-exponent-marker=e,
  group-digits=integer, group-minimum-digits=4, group-separator={,}, table-align-exponent=false}"""
_NUMBER = re.compile(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?")
# Between letters that TeX would join.
_LIGATURE = re.compile(r"(?<=-)(?=-)|(?<=')(?=')|(?<=,)(?=,)|(?<=[?!])(?=`)|(?<=[<>])(?=[<>])")
_SPECIAL = {
    "\0": "{}",
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    "`": r"\textasciigrave{}",
    "−": r"\textminus{}",
    "⁻": r"\ensuremath{^-}",
    "≤": r"\ensuremath{\leq}",
    "≥": r"\ensuremath{\geq}",
    "∞": r"\ensuremath{\infty}",
} | {letter: f"\\{letter}" for letter in "{}$&#%_"}
_NAMES = """alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho varsigma
sigma tau upsilon phi chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"""
_GREEK = zip("αβγδεζηθικλμνξπρςστυφχψωΓΔΘΛΞΠΣΥΦΨΩ", _NAMES.split(), strict=True)
_SPECIAL |= {letter: rf"\ensuremath{{\{name}}}" for letter, name in _GREEK}
# Letters read unchanged by LaTeX since 2020, beside letters with accents.
_PLAIN, _LAST_LATIN = set("–“”‘’…µ°¹²³×±·→"), 0x17F


def latex(table: Table) -> str:
    """Return a table as LaTeX, the best cells bold; comments state the needed packages."""
    best = best_cells(table)
    formats = [_number_format([row[j] for row in table.rows]) for j in range(len(table.columns))]
    kinds = [
        f"S[table-format={form}]" if form else "l" if column.words else "r"
        for form, column in zip(formats, table.columns, strict=True)
    ]
    rows = (
        " & ".join(_cell(cell, (i, j) in best) for j, cell in enumerate(row))
        for i, row in enumerate(table.rows)
    )
    head = " & ".join(f"{{{escaped(column.heading)}}}" for column in table.columns)
    label = re.sub(r"[^\w:.-]", "-", table.name, flags=re.ASCII)
    lines = [
        _PREAMBLE,
        r"\begin{table}",
        r"\centering",
        _NUMBERS,
        rf"\caption{{{escaped(table.title)}.}}\label{{tab:{label}}}",
        rf"\begin{{tabular}}{{@{{}}{' '.join(kinds)}@{{}}}}",
        r"\toprule",
        rf"{head} \\",
        r"\midrule",
        *(rf"{row} \\" for row in rows),
        r"\bottomrule",
        r"\end{tabular}",
        rf"\par\medskip\raggedright{{}}{escaped(_note(table))}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _cell(cell: Cell, is_best: bool) -> str:
    """Return a cell: a number as is, words in braces, which siunitx does not read."""
    bold = r"\bfseries " if is_best else ""
    text = words(cell)
    return bold + (text.replace(",", "") if _is_number(cell) else f"{{{escaped(text)}}}")


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool) and math.isfinite(cell)


def _number_format(cells: Sequence[Cell]) -> str:
    """Return siunitx's format of the numbers of a column, such as -3.4e-2, "" without numbers."""
    texts = [words(cell).replace(",", "") for cell in cells if _is_number(cell)]
    parts = [match.groups("") for match in map(_NUMBER.fullmatch, texts) if match]
    if not parts:
        return ""
    sign, whole, decimals, power_sign, power = (
        max(map(len, of)) for of in zip(*parts, strict=True)
    )
    exponent = f"e{'-' * power_sign}{power}" if power else ""
    return f"{'-' * sign}{whole}{f'.{decimals}' if decimals else ''}{exponent}"


def _note(table: Table) -> str:
    """Return the note below a table: set-up, samples, machine and versions."""
    best = "Best in bold, ties too." * bool(best_cells(table))
    provenance = table.provenance and f"{table.provenance}."
    return " ".join(filter(None, (table.shows, table.measured, best, provenance)))


def escaped(text: str) -> str:
    """Return a text as data for TeX; a letter that not every TeX has becomes a Python escape."""
    return "".join(map(_letter, _LIGATURE.sub("\0", " ".join(text.split()).replace("\0", "␀"))))


def _letter(letter: str) -> str:
    if letter in _SPECIAL:
        return _SPECIAL[letter]
    is_latin = letter.isalpha() and ord(letter) <= _LAST_LATIN
    if is_latin or letter in _PLAIN or (letter.isascii() and letter.isprintable()):
        return letter
    return "".join(map(_letter, letter.encode("unicode_escape").decode()))
