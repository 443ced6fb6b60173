"""LaTeX: a table compiles, its cells are those of Markdown, and every name is data."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.bench.measure.metrics import share
from plumbob.bench.page import sections
from plumbob.bench.tables.latex import escaped, latex
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import Column, Table
from plumbob.bench.tables.writers import markdown

HOSTILE = 'a|b & 50% of_x #1 {y} $z^2 ~ \\cmd <script>"quoted", `code` *star* [link](x)\nnext'
NAMES = (
    *(HOSTILE, r"\input{/etc/passwd}", r"$\frac{$", "[red]x", "*[2cm]", "x" * 500, "é ß Å ł"),
    *(r"\end{tabular}\\", "--- ,, '' ?` !`", "%", "~^_", "{", "}", "$", "&", "\\"),
    *("ω² ≤ M⁻¹ K − 2 × 3 · 10 → ∞", "αβγδεζηθικλμνξπρςστυφχψω ΓΔΘΛΞΠΣΥΦΨΩ", "1.2e-5"),
)
# Letters that not every TeX has.
STRANGE = ("手腕", "\x00\x07", "a\u202eb", "\N{GREEK SMALL LETTER OMICRON}")
COLUMNS = (Column("name", words=True), Column("value", "m", best="least"))
COMMANDS = {
    "textbackslash": "\\", "textasciicircum": "^", "textasciitilde": "~", "textless": "<",
    "textgreater": ">", "textbar": "|", "textquotedbl": '"', "textasciigrave": "`",
    "textminus": "−", "leq": "≤", "geq": "≥", "infty": "∞", "alpha": "α", "beta": "β",
    "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ", "eta": "η", "theta": "θ",
    "iota": "ι", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π",
    "rho": "ρ", "varsigma": "ς", "sigma": "σ", "tau": "τ", "upsilon": "υ", "phi": "φ",
    "chi": "χ", "psi": "ψ", "omega": "ω", "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ",
    "Lambda": "Λ", "Xi": "Ξ", "Pi": "Π", "Sigma": "Σ", "Upsilon": "Υ", "Phi": "Φ", "Psi": "Ψ",
    "Omega": "Ω",
}  # fmt: skip


def table(*rows, columns=COLUMNS, **more):
    return Table("t", "Title", columns, rows, **more)


def hostile():
    columns = (Column("name", words=True), Column("[note] &", words=True), Column("x", "kg m²"))
    rows = tuple((name, name, 1.0 / (i + 1)) for i, name in enumerate(NAMES))
    return Table('t"}\\x', HOSTILE, columns, rows, HOSTILE, HOSTILE, provenance="x" * 500)


def mixed():
    """Numbers of all kinds in one column, shares of one total and of several."""
    numbers = [1, 12_345, -1.2e-15, 0.0123, 123_456.0, float("nan"), None, float("inf"), 2.5e9, 0.0]
    columns = (Column("i"), Column("n", best="greatest"), Column("of 100"), Column("of several"))
    rows = [(i, n, share(np.arange(100) < 9 * i), share(np.arange(50 + i) < i))
            for i, n in enumerate(numbers)]  # fmt: skip
    return Table("mixed", "Mixed", columns, tuple(rows), compared=0)


@pytest.fixture(scope="module")
def every_table(records):
    """The tables of a report, and some that are harder."""
    return [*sections.tables(Results(records)), hostile(), mixed(), table(), table(("a", 1.0))]


def unescaped(text):
    """The text that TeX sets."""
    text = text.replace(r"\ensuremath{^-}", "⁻")
    text = re.sub(r"\\ensuremath\{\\(\w+)\}", lambda match: COMMANDS[match[1]], text)
    commands = re.compile(r"\\(text[a-z]+)\{\}|\\([{}$&#%_])|(\{\})")
    return commands.sub(lambda m: COMMANDS[m[1]] if m[1] else m[2] or "", text)


def cells_of_latex(text):
    lines = text.partition("\\toprule\n")[2].partition("\\bottomrule")[0].splitlines()
    rows = [line.removesuffix(r" \\").split(" & ") for line in lines]
    cells = [[cell.removeprefix(r"\bfseries ") for cell in row] for row in rows]
    return [[unescaped(c[1:-1] if c[0] == "{" else c) for c in row]
            for row in cells if row != [r"\midrule"]]  # fmt: skip


def cells_of_markdown(text):
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    plain = [line[2:-2].replace("**", "").split(" | ") for line in lines]
    return [[re.sub(r"\\(.)", r"\1", cell) for cell in line] for line in plain[:1] + plain[2:]]


def without_thousands(rows):
    """Rows with the commas of numbers left to siunitx."""
    number = re.compile(r"-?[\d,]+(\.\d+)?(e-?\d+)?")
    return [[c.replace(",", "") if number.fullmatch(c) else c for c in row] for row in rows]


def test_the_cells_are_those_of_the_table_in_markdown(every_table):
    for made in every_table:
        expected = without_thousands(cells_of_markdown(markdown(made)))
        assert cells_of_latex(latex(made)) == expected, made.name
        assert len(expected) == 1 + len(made.rows)


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="pdflatex is not installed")
def test_all_tables_compile(every_table, tmp_path):
    """Beside what the tables themselves ask for, only letters that scale to any size."""
    asked = {line[2:] for made in every_table for line in latex(made).splitlines()[:2]}
    body = "\n\\clearpage\n".join(map(latex, every_table))
    head = r"\documentclass{article}\usepackage{lmodern}" + "\n".join(sorted(asked))
    text = f"{head}\n\\begin{{document}}{body}\\end{{document}}"
    (tmp_path / "all.tex").write_text(text, encoding="utf-8")
    options = ["-halt-on-error", "-interaction=nonstopmode", "-no-shell-escape"]
    run = subprocess.run(
        ["pdflatex", *options, "all.tex"], cwd=tmp_path, capture_output=True, timeout=300
    )
    log = (tmp_path / "all.log").read_text(encoding="utf-8", errors="replace")
    assert run.returncode == 0, [line for line in log.splitlines() if line.startswith("!")]


@pytest.mark.parametrize("name", [*NAMES, *STRANGE])
def test_braces_and_environments_close_in_turn_whatever_a_name_is(name):
    made = Table(name, name, (Column(f"{name} "), Column("b")), ((name, 1.0),), name, name)
    lines = latex(made).splitlines()
    text = re.sub(r"\\[{}%\\]", "", "\n".join(line for line in lines if not line.startswith("%")))
    depths = np.cumsum([{"{": 1, "}": -1}.get(character, 0) for character in text])
    assert depths.min() == depths[-1] == 0
    ends = re.findall(r"\\(begin|end)\{([a-z*]+)\}", text)
    assert ends == [("begin", "table"), ("begin", "tabular"), ("end", "tabular"), ("end", "table")]


@given(st.text(max_size=40))
def test_a_text_is_data_of_letters_that_every_tex_has(text):
    made = escaped(text)
    assert all(ord(letter) <= 0x17F or letter in "–“”‘’…→" for letter in made)
    assert "\n" not in made
    rest = re.sub(r"\\(text[a-z]+|ensuremath|[a-zA-Z]+)\b|\\[{}$&#%_]", "", made)
    assert not set(re.sub(r"\{.*?\}", "", rest)) & set("$&#%^~\\")


@pytest.mark.parametrize("name", STRANGE)
def test_a_letter_that_not_every_tex_has_is_written_as_in_python(name):
    code = name.encode("unicode_escape").decode()
    assert unescaped(escaped(name)) == code.replace(r"\x00", "␀".encode("unicode_escape").decode())


def test_numbers_are_aligned_by_siunitx_and_the_best_are_bold_ties_too():
    text = latex(table(("a", 1.2e-5), ("b", 12_345.0), ("c", 1.2001e-5), compared=0))
    for part in ("{@{}l S[table-format=5.1e-1]@{}}", r"{a} & \bfseries 1.2e-5 \\",
                 r"{c} & \bfseries 1.2e-5 \\", r"{b} & 12300 \\", "Best in bold"):  # fmt: skip
        assert part in text


def test_a_note_says_how_many_on_which_machine_with_what(records):
    (made,) = [t for t in sections.tables(Results(records)) if t.name == "accuracy"]
    note = latex(made).split(r"\end{tabular}")[1]
    for fact in (
        "Starts:",
        "2 to 3 targets",
        "tolerance 1.0e-4",
        "slide",
        "Plumbob 0.0",
        "2000-01-02",
    ):
        assert fact in note
