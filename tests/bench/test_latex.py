"""LaTeX: every table compiles, nothing is smaller than eight points, and every name is data."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.bench.harness.metrics import Share, share
from plumbob.bench.report import sections
from plumbob.bench.tables import latex, tex_text
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import Column, Table

HOSTILE = 'a|b & 50% of_x #1 {y} $z^2 ~ \\cmd <script>"quoted", `code` *star* [link](x)\nnext'
NAMES = (
    *(HOSTILE, r"\input{/etc/passwd}", r"$\frac{$", "[red]x", "*[2cm]", "x" * 5_000, "手腕"),
    *("é ß Å ł", r"\end{tabular}\\", "--- ,, '' ?` !`", "%", "", "~^_", "{", "}", "$", "&"),
    *("ω² ≤ M⁻¹ K − 2 × 3 · 10 → ∞", "Levenberg-Marquardt/very_long-winded.name"),
    *("\x00\x07", "a\u202eb", "0" * 60, "1.2e-5"),
)  # fmt: skip
# An overfull box of this little [pt] is not seen; widths are rounded to a tenth of a point.
OVERFULL = 1.0
COLUMNS = (Column("name", words=True), Column("value", "m", best="least"))


def table(*rows, columns=COLUMNS, **more):
    return Table("t", "Title", columns, rows, **more)


def many_columns(count, rows=2):
    """A table far too wide for a page."""
    columns = [Column("solver", words=True), Column("remark", words=True, folded=True)]
    columns += [
        Column(f"time, of kind {i}", "µs", group="time", best="least") for i in range(count)
    ]
    cells = [(f"solver {i}", "said " * 30, *(10.0 ** (j % 9 - 5) for j in range(count)))
             for i in range(rows)]  # fmt: skip
    return Table("wide", "A wide table", tuple(columns), tuple(cells), compared=0)


def hostile():
    rows = [(a, b, 1.0 / (i + 1)) for i, a in enumerate(NAMES) for b in NAMES[i : i + 1]]
    columns = (Column("name", words=True), Column("note", words=True), Column("value", "kg m²"))
    return Table('t"}\\x', HOSTILE, columns, tuple(rows), HOSTILE, HOSTILE, provenance="x" * 3_000)


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
    long = [(f"solver {i}", 1.0 / (i + 1)) for i in range(120)]
    harder = [many_columns(30), many_columns(12, 60), hostile(), mixed(), table(*long), table()]
    return sections.tables(Results(records)) + harder


def document(tables, width):
    """A whole document of tables, as wide as they may be, in fonts that scale to any size."""
    body = "\n\\clearpage\n".join(latex.latex(made, width) for made in tables)
    return (
        r"\pdfcompresslevel=0 \pdfobjcompresslevel=0 \documentclass{article}"
        r"\usepackage[T1]{fontenc}\usepackage{lmodern,booktabs,tabularx,siunitx}"
        rf"\usepackage[textwidth={latex.paper(width)[0]:.1f}pt,textheight=640pt]{{geometry}}"
        rf"\begin{{document}}{body}\end{{document}}"
    )


def typeset(folder, text):
    """Compile a document, if there is a pdflatex; return its log and PDF."""
    if not shutil.which("pdflatex"):
        pytest.skip("pdflatex is not installed")
    (folder / "all.tex").write_text(text, encoding="utf-8")
    options = ["-halt-on-error", "-interaction=nonstopmode", "-no-shell-escape"]
    run = subprocess.run(
        ["pdflatex", *options, "all.tex"], cwd=folder, capture_output=True, timeout=300
    )
    log = (folder / "all.log").read_text(encoding="utf-8", errors="replace")
    assert run.returncode == 0, [line for line in log.splitlines() if line.startswith("!")]
    return log, folder / "all.pdf"


@pytest.fixture(scope="module", params=["page", "column"])
def compiled(request, every_table, tmp_path_factory):
    """The log and the uncompressed PDF of all tables."""
    return typeset(tmp_path_factory.mktemp("tex"), document(every_table, request.param))


def test_all_tables_compile_and_none_sticks_out(compiled):
    log, _ = compiled
    wide = [float(points) for points in re.findall(r"Overfull .hbox \(([\d.]+)pt", log)]
    assert max(wide, default=0.0) <= OVERFULL
    assert "too large for page" not in log
    assert not re.findall(r"Overfull .vbox.*", log)


def test_no_text_is_smaller_than_eight_points(compiled):
    """What is set in a font says so by Tf [1/72 inch], and no matrix but the identity scales it.

    pdfTeX writes `/F8 7.9701 Tf` for 8 points; scaling by \\resizebox would leave this and write a
    matrix `x 0 0 x 0 0 cm` around it.
    """
    pdf = compiled[1].read_bytes()
    sizes = [72.27 / 72 * float(size) for size in re.findall(rb"/F\d+ ([\d.]+) Tf", pdf)]
    assert len(sizes) > 1000
    assert min(sizes) > 7.999
    scaled = set(re.findall(rb"([-\d.]+) [-\d.]+ [-\d.]+ ([-\d.]+) [-\d.]+ [-\d.]+ cm", pdf))
    assert scaled <= {(b"1", b"1")}
    assert not re.search(rb"\d T[zs]\s", pdf)  # not in the bytes of a font


WORD = re.compile(
    r'xMin="([-\d.]+)" yMin="([-\d.]+)" xMax="([-\d.]+)" yMax="([-\d.]+)">(.*?)</word>'
)


def test_no_word_stands_upon_another(compiled):
    """siunitx lets numbers stick out of a column without a word: no boxes overlap by a point."""
    if not shutil.which("pdftotext"):
        pytest.skip("pdftotext is not installed")
    command = ["pdftotext", "-bbox", str(compiled[1]), "-"]
    text = subprocess.run(command, capture_output=True, timeout=60, check=True).stdout.decode()
    for page in text.split("<page ")[1:]:
        found = [(*map(float, w[:4]), w[4]) for w in WORD.findall(page)]
        found.sort(key=lambda w: w[1])
        for i, (left, top, right, bottom, word) in enumerate(found):
            for x, y, to, down, other in found[i + 1 :]:
                if y > bottom:
                    break
                upon = min(right, to) - max(left, x) > 1 and min(bottom, down) - max(top, y) > 4
                assert not upon, (word, other)


@pytest.mark.parametrize("name", NAMES)
def test_braces_and_environments_close_in_turn_whatever_a_name_is(name):
    made = Table(
        name, name, (Column(f"{name} "), Column("b", group=name)), ((name, 1.0),), name, name
    )
    lines = latex.latex(made).splitlines()
    text = re.sub(r"\\[{}%\\]", "", "\n".join(line for line in lines if not line.startswith("%")))
    depths = np.cumsum([{"{": 1, "}": -1}.get(character, 0) for character in text])
    assert depths.min() == depths[-1] == 0
    opened = []
    for what, inner in re.findall(r"\\(begin|end)\{([a-z*]+)\}", text):
        if what == "begin":
            opened.append(inner)
        else:
            assert opened.pop() == inner
    assert opened == []


@given(st.text(max_size=40))
def test_a_text_is_data_of_letters_that_every_tex_has(text):
    made = tex_text.breakable(text)
    assert all(ord(letter) <= 0x17F or letter in "–“”‘’…→" for letter in made)
    assert "\n" not in made
    rest = re.sub(r"\\(text\w+|ensuremath|hspace|raisebox|num|[a-zA-Z]+)\b|\\[{}$&#%_]", "", made)
    assert not set(re.sub(r"\{.*?\}", "", rest)) & set("$&#%^~\\")


def test_numbers_are_aligned_by_siunitx_and_the_best_are_bold_ties_too():
    text = latex.latex(table(("a", 1.2e-5), ("b", 0.5), ("c", 1.2001e-5), compared=0))
    for part in ("S[table-format=1.3e-1]", r"a & \bfseries 1.2e-5 \\", r"c & \bfseries 1.2e-5 \\",
                 "b & 0.500", "Best in bold"):  # fmt: skip
        assert part in text
    assert text.index("belowcaptionskip") < text.index("caption[")


@pytest.mark.parametrize("remark", ["", "cut"])
def test_only_a_column_in_which_nothing_stands_is_not_set(remark):
    columns = (Column("solver", words=True), Column("remark", words=True), Column("time", "s"))
    text = latex.latex(Table("t", "T", columns, (("CCD", remark, 1.0), ("LM", "", None))))
    assert ("remark" in text) == bool(remark)
    assert f"CCD & {remark}{' & ' * bool(remark)}1.00" in text


def test_a_share_says_its_total_once_where_all_have_the_same():
    same = latex.latex(table(("a", Share(1, 2, 0.1, 0.9)), ("b", Share(2, 2, 0.3, 1.0))))
    assert "(of 2)" in same
    assert "b & 100 (30–100)" in same.replace(r"\bfseries ", "")
    several = latex.latex(table(("a", Share(1, 2, 0.1, 0.9)), ("b", Share(2, 3, 0.3, 1.0))))
    assert r"of 3 \\" in several


def test_groups_have_a_heading_in_common_and_rows_of_one_name_are_set_apart():
    times = (Column(f"time, {n}", group="time") for n in ("a", "b"))
    text = latex.latex(table(("x", 1.0, 2.0), columns=(Column("name", words=True), *times)))
    for part in (r"\multicolumn{2}{c}{time}", r"\cmidrule(lr){2-3}", "{a} & {b}"):
        assert part in text
    assert "addlinespace" not in latex.latex(table(("a", 1), ("b", 2)))
    assert latex.latex(table(("a", 1), ("a", 2), ("b", 3))).count("addlinespace") == 1


@pytest.mark.parametrize("width", ["page", "column"])
@pytest.mark.parametrize(("rows", "count"), [(30, 1), (60, 2), (130, 3)])
def test_more_rows_than_a_page_holds_stand_in_more_tables(rows, count, width):
    """Never in a longtable, which does not work in two columns."""
    text = latex.latex(table(*((f"{i}", 1.0) for i in range(rows)), measured="So."), width)
    assert "longtable" not in text
    assert text.count(r"\toprule") == text.count(r"\caption[") == count
    assert re.findall(r"^(\d+) & 1.00", text, re.MULTILINE) == [str(i) for i in range(rows)]
    assert (f"(part {count} of {count})." in text) == (count > 1)
    assert text.count("So.") == text.count(r"\label") == 1


def test_rows_without_a_number_are_left_out():
    """A solver that is not installed takes no line of a paper."""
    rows = (("a", 2.0), ("absent", None), ("b", 1.0))
    text = latex.latex(table(*rows, compared=0))
    assert "absent" not in text
    assert "1 of 3 rows left out: they hold no number" in text
    assert r"b & \bfseries 1.00" in text
    words_only = table(("a", "x"), columns=(COLUMNS[0], Column("note", words=True)))
    assert "a & x" in latex.latex(words_only)


def test_what_is_too_wide_loses_folded_columns_then_stands_in_parts():
    text = latex.latex(many_columns(20), "column")
    assert "said" not in text
    assert "1 of 22 columns left out" in text
    assert text.count(r"\begin{tabular}{@{}") > 1
    assert text.count("solver 1") == text.count(r"\toprule") > 1
    assert len(re.findall(r"S\[", text)) == 20


def test_a_caption_is_one_sentence_and_a_note_says_how_many_on_which_machine_with_what(records):
    (made,) = [t for t in sections.tables(Results(records)) if t.name == "accuracy"]
    caption, arm = latex.latex(made).split(r"\caption")[1].split(r"\label")
    assert caption.endswith(f"{{{made.title}.}}")
    assert caption.count(".") == 1
    assert arm.index(r"\bottomrule") < arm.index("minipage") < arm.index("Starts:")
    for fact in ("n = 2 to 3", r"tolerance \num{1.0e-4}", "slide", "Plumbob 0.0", "2000-01-02"):
        assert fact in arm
    assert "Starts:" in arm


@pytest.mark.parametrize("width", ["", "wide", "-3mm", "10mm", "1e9in", "3", "3 ells"])
def test_a_width_that_is_none_is_refused(width):
    with pytest.raises(ValueError, match="--width: expected column, page or a length"):
        latex.paper(width)
