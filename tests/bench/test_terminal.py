"""The terminal: no digit is cut and no name shortened, at any width; a run ends with an answer."""

import functools
import io
import itertools
import re

import command_names
import pytest
from rich.cells import cell_len
from rich.console import Console

from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page import outcome, report, sections
from plumbob.bench.page.headlines import ClaimCount, Headline, Overview
from plumbob.bench.tables import aligned
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import Column, Table, naming, without_empty, words
from plumbob.cli import main as cli
from plumbob.cli import terminal

WIDTHS = (*range(40, 110, 5), 133, 160, 200)
FEW = (40, 57, 80, 133, 200)


@pytest.fixture(scope="module")
def every_table(records):
    """The tables of a report, and one of long names, many columns and long numbers."""
    made = sections.tables(Results(records))
    columns = (Column("solver", words=True), Column("of", words=True))
    columns += tuple(Column(f"time, kind {i}", "µs", best="least") for i in range(20))
    names = ("Levenberg-Marquardt, 100 restarts", "Levenberg-Marquardt, 20 restarts", "手腕" * 9)
    rows = [(n, "x" * 70, *(-1.2345e-15 * 10**i for i in range(20))) for n in names]
    return [*made, Table("hard", "Hard", columns, tuple(rows))]


@functools.cache
def of_number(identity, width):
    return aligned.aligned(TABLES[identity], width)


TABLES = {}


def made_in(table, width):
    """A table in lines; made once for all tests."""
    TABLES[id(table)] = table
    return of_number(id(table), width)


def lines_of(table, width):
    return [line.plain for line in made_in(table, width).lines]


def columns_of(table, width):
    """The lines of each column that is shown, as they stand below each other."""
    made = made_in(table, width)
    ends = [sum(made.widths[: k + 1]) + aligned.GAP * k for k in range(len(made.widths))]
    return [
        [cut(line.plain, end - wide, end).strip() for line in made.lines]
        for end, wide in zip(ends, made.widths, strict=True)
    ]


def cut(text, begin, end):
    """The letters of a text between two columns of the terminal."""
    places = itertools.accumulate(map(cell_len, text), initial=0)
    return "".join(c for c, x in zip(text, places, strict=False) if begin <= x < end)


def test_no_line_is_wider_than_the_terminal(every_table):
    for table in every_table:
        for width in WIDTHS:
            assert max(map(cell_len, lines_of(table, width))) <= width, (table.name, width)


def test_no_digit_is_cut_and_no_name_is_shortened(every_table):
    """Every cell of a column that is shown is there letter by letter, its numbers in one line."""
    for table in every_table:
        for width in WIDTHS:
            made = made_in(table, width)
            filled = without_empty(table).columns
            shown = [c for c in filled if c.heading not in made.left_out]
            assert len(shown) == len(made.widths)
            for column, texts in zip(shown, columns_of(table, width), strict=True):
                j = table.columns.index(column)
                together = "".join(texts).replace(" ", "")
                wanted = [column.heading, *(words(row[j]) for row in table.rows)]
                assert together == "".join(wanted).replace(" ", ""), (table.name, width)
                numbers = [n for w in wanted for n in re.findall(r"\d[\d.,]*(?:e-?\d+)?", w)]
                found = [n for t in texts for n in re.findall(r"\d[\d.,]*(?:e-?\d+)?", t)]
                assert found == numbers, (table.name, width)


def test_what_names_a_row_and_one_more_column_are_always_there(every_table):
    for table in every_table:
        for width in FEW:
            left = made_in(table, width).left_out
            assert table.columns[0].heading not in left
            assert len(left) < len(table.columns) - 1


def test_folded_columns_are_dropped_first_and_the_best_last(every_table):
    for table in every_table:
        for width in WIDTHS:
            left, filled = made_in(table, width).left_out, without_empty(table)
            assert {c.heading for c in filled.columns[1:] if c.folded} <= {*left} | names(filled)
    columns = tuple(Column(n, best=b) for n, b in (("a", ""), ("b", "least"), ("c", ""), ("d", "")))
    table = Table("t", "T", columns, ((1, 10**12, 10**12, 10**12), (2, 2, 2, 2)))
    assert [made_in(table, w).left_out for w in (60, 45, 30)] == [[], ["d"], ["c", "d"]]


def names(table):
    """The headings of the columns that name a row."""
    return {column.heading for column in table.columns[: naming(table)]}


def test_a_sentence_says_how_many_columns_are_left_out_and_what_shows_them(
    capsys, tmp_path, records, monkeypatch
):
    RecordFile(tmp_path).append(records)
    monkeypatch.setenv("COLUMNS", "60")
    terminal.print_tables(["cloth"], tmp_path)
    out = capsys.readouterr().out
    assert re.search(r"\d of \d+ columns left\s+out", out)
    assert "--table cloth_peers_step" in " ".join(out.split())
    assert max(map(cell_len, out.splitlines())) <= max(60, len(str(tmp_path)))


def test_rows_that_miss_are_red_and_the_best_bold():
    columns = (
        Column("claim", words=True),
        Column("verdict", words=True),
        Column("x", best="least"),
    )
    rows = (("a", "MISSED: far", 1.0), ("b", "held", 2.0))
    made = aligned.aligned(Table("t", "T", columns, rows, compared=0), 80)
    assert styled(made.lines[1]) == [
        ("a", "bold red"),
        ("MISSED: far", "bold red"),
        ("1.00", "bold red"),
    ]
    assert styled(made.lines[2]) == []
    held = aligned.aligned(Table("t", "T", columns, (rows[1], ("c", "held", 3.0)), compared=0), 80)
    assert styled(held.lines[1]) == [("2.00", "bold")]


def styled(line):
    """The words of a line that are styled, and how."""
    parts = [(line.plain[s.start : s.end].strip(), str(s.style)) for s in line.spans]
    return [(text, style) for text, style in parts if text and style != "none"]


@pytest.mark.parametrize("width", [30, 40, 60, 80, 200])
@pytest.mark.parametrize(
    "what", ["x", "a long name of a problem and of a solver that is slow " * 3]
)
def test_bar_count_and_time_left_are_there_at_any_width(monkeypatch, width, what):
    text = io.StringIO()
    monkeypatch.setattr(terminal.sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(width))
    bar = terminal.progress()
    console = Console(file=text, width=width, force_terminal=True, color_system=None)
    task = bar.add_task(what, total=12_345, kept=0)
    bar.update(task, completed=6234)
    bar.tasks[0].start_time = bar.get_time() - 7200
    console.print(bar.get_renderable())
    (line,) = text.getvalue().strip("\n").split("\n")
    assert "6234/12345" in line
    assert re.search(r"\d:\d\d:\d\d left", line)
    assert "━" in line
    assert cell_len(line.rstrip()) <= width


def an_outcome(folder, tables=(), **more):
    verdict = ClaimCount(52, 52, "spring forces", 0.462)
    parts = [(task, start) for task in ("Fastest", "Most poses") for start in "ab"]
    headlines = [
        Headline("kinematics", f"{task}, {group}, {start}", f"{group}, {task}, {start}.", "robots")
        for group in ("held out", "tuning") for task, start in parts
    ]  # fmt: skip
    wins = [Headline("cloth", "Others", f"{n} wins.", "cloths") for n in ("A", "B")]
    answers = Overview(verdict, headlines, "Quick run", ["pink", "mink"], [], wins)
    answers = answers._replace(**more)
    missing = ["a"] + ["A sentence on what is missing, which is rather long. " * 3] * 20
    return report.BenchReport(folder / "index.html", list(tables), missing, answers)


@pytest.mark.parametrize("width", [80, 120, 240])
@pytest.mark.parametrize("absent", [[], ["pink"], [f"solver {i}" for i in range(60)]])
def test_a_run_ends_with_an_answer(capsys, tmp_path, monkeypatch, width, absent):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr(outcome, "peers_command", lambda: "make peers")
    monkeypatch.chdir(tmp_path)
    written = an_outcome(tmp_path.relative_to(tmp_path), absent=absent)
    terminal.print_outcome(written)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= outcome.LINES
    assert max(map(len, lines)) <= width
    assert "52 of 52 claims hold" in lines[0]
    text = "\n".join(lines)
    best = [line.removeprefix("Best: held out, ") for line in lines if line.startswith("Best")]
    assert best == ["Most poses, a.", "Most poses, b.", "Fastest, a."]
    assert "Others win: A wins. 1 more win of others: see the page." in text
    assert lines[-1].startswith("Read on: index.html")
    assert "Missing: a" in text
    assert "index.html" in text
    assert ("Absent" in text) == bool(absent)
    assert re.search(r"\d+ more remarks", text)
    if len(absent) > 1:
        absence = r"Absent: solver 0, .*, \d+ more; `make peers` adds"
        assert re.search(absence, text.replace("\n", " "))


def test_who_is_absent_is_said_once(tmp_path):
    written = an_outcome(tmp_path, absent=["pink", "mink"])
    written.missing[:] = ["Absent peers: pink and mink. `make peers` adds them.", "b"]
    lines = outcome.outcome(written, 120)
    assert sum("pink" in line for line in lines) == 1
    assert "Missing: b" in lines


def test_a_missed_claim_is_said_first(tmp_path):
    written = an_outcome(tmp_path, verdict=ClaimCount(51, 52, "spring forces", 3.0))
    assert outcome.outcome(written, 80)[0] == "WRONG: 1 of 52 claims are missed."
    written = an_outcome(tmp_path, verdict=None)
    assert "bench check" in outcome.outcome(written, 80)[0]


@pytest.mark.parametrize("command", command_names.COMMANDS)
def test_help_is_no_wider_than_the_terminal(capsys, monkeypatch, command):
    full = None
    for width in (200, 40, 57, 80, 100):
        monkeypatch.setenv("COLUMNS", str(width))
        assert cli.run_command([*command.split(), "--help"]) == 0
        out = capsys.readouterr().out
        assert max(map(len, out.splitlines())) <= width, width
        full = full or re.sub(r"\s", "", out)
        assert re.sub(r"\s", "", out) == full


@pytest.mark.parametrize(
    ("completed", "total", "kept", "left"),
    [
        (0, 15, 0, "? left"), (5, 15, 5, "? left"), (10, 15, 5, "0:10 left"),
        (5, 20, 0, "0:30 left"), (8, 883, 0, "? left"), (18, 883, 10, "? left"),
        (9, 883, 0, "16:11 left"), (450, 883, 0, "0:10 left"),
    ],
)  # fmt: skip
def test_the_time_left_goes_by_steps_that_took_time_after_a_hundredth(completed, total, kept, left):
    """The first of 883 rows compile: they told hours where minutes were left."""
    assert terminal.time_left(10.0, completed, total, {"kept": kept}) == left
