"""`plumbob report --table`: columns, rows and order as a user names them, in four forms."""

import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from html_page import Page

from plumbob.bench.measure.metrics import Share, share
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page import sections
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.selection import column_numbers, selected
from plumbob.bench.tables.table import NO_SUMMARY, Column, Summary, Table, best_cells, words
from plumbob.bench.tables.writers import comma_separated, html_fragment, markdown
from plumbob.cli import main as cli

COLUMNS = (
    Column("robot", words=True),
    Column("solver", words=True),
    Column("time, median", "µs", best="least", group="time"),
    Column("time, 95 %", "µs", best="least", group="time", folded=True),
    Column("solved", note="95 % interval", best="greatest"),
)
ROWS = (
    ("UR5", "Newton", 3.0, 4.0, share(np.arange(10) < 9)),
    ("UR5", "local/global", 1.0, 40.0, share(np.arange(10) < 1)),
    ("iiwa", "Newton", 2.0, None, share(np.arange(10) < 5)),
    ("iiwa", "local/global", 20.0, 1 / 3, Share(0, 0, 0.0, 1.0)),
)
TABLE = Table("robots", "Robots", COLUMNS, ROWS)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("solver", [1]),
        ("time, median", [2]),
        ("time, median [µs]", [2]),
        ("solver, time, median, SOLVED", [1, 2, 4]),
        ("solved (95 % interval)", [4]),
        ("time, 95 %,robot", [3, 0]),
    ],
)
def test_columns_are_named_by_heading_or_title(text, numbers):
    assert column_numbers(TABLE, text) == numbers


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("solvr", "no column 'solvr': did you mean 'solver'?"),
        ("time, medina", "did you mean 'time, median"),
        ("solvd", "did you mean 'solved (95 % interval)'?"),
        ("qqq", "expected one of 'robot', 'solver', 'time, median [µs]', "),
        ("2", "no column '2'"),
        ("solver,", "no column ''"),
    ],
)
def test_a_column_that_is_not_there_is_refused_with_the_nearest(text, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        column_numbers(TABLE, text)


@pytest.mark.parametrize(
    ("rows", "left"),
    [
        (["solver=newton"], [0, 2]),
        (["solver=local_global"], [1, 3]),
        (["robot~ur"], [0, 1]),
        (["robot~ur", "solver=Newton"], [0]),
        (["robot=ur5", "robot=IIWA", "solver=Newton"], [0, 2]),
        (["time, median = 3.00"], [0]),
    ],
)
def test_rows_pass_one_filter_of_each_column(rows, left):
    assert selected(TABLE, rows=rows).rows == tuple(ROWS[i] for i in left)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("solver", "expected COLUMN=VALUE or COLUMN~PART, got 'solver'"),
        ("solver<2", "expected COLUMN=VALUE"),
        ("solvr=x", "did you mean 'solver'?"),
        ("solver=CCD", "no row of robots passes; solver is Newton, local/global"),
        ("robot,solver=x", "no column"),
    ],
)
def test_a_filter_that_is_none_is_refused(text, sentence):
    with pytest.raises(ValueError, match=sentence):
        selected(TABLE, rows=[text])


@pytest.mark.parametrize(
    ("column", "order"),
    [
        ("time, median", [1, 2, 0, 3]),
        ("solved", [0, 2, 1, 3]),
        ("time, 95 %", [3, 0, 1, 2]),
        ("robot", None),
    ],
)
def test_rows_are_sorted_the_best_first_and_what_is_unknown_last(column, order):
    made = selected(TABLE, order=column)
    assert made.rows == tuple(ROWS[i] for i in order or range(4))


def test_the_best_are_those_of_the_rows_left_by_the_columns_of_before():
    assert best_cells(selected(TABLE, ["time, median"])) == {(1, 0), (2, 0)}
    rows, order = ["solver=Newton", "solver=local/global"], "time, median"
    swapped = selected(TABLE, [f"{order}, robot"], rows, order)
    assert {swapped.rows[i][1] for i, j in best_cells(swapped)} == {"UR5", "iiwa"}
    assert best_cells(selected(TABLE, ["time, median"], ["solver=Newton"])) == set()


def test_a_summary_of_all_rows_is_not_said_of_some():
    table = replace(TABLE, summary=Summary("Newton solves more."))
    assert selected(table, ["solver"]).summary == table.summary
    assert selected(table, rows=["solver~o"]).summary == table.summary
    assert selected(table, rows=["solver=Newton"]).summary == NO_SUMMARY
    assert selected(TABLE).columns == COLUMNS


def test_all_forms_say_the_same_and_csv_keeps_all_digits():
    page, text = Page(html_fragment(TABLE)), markdown(TABLE)
    assert page.open == page.wrong == []
    assert not {*page.tags} & {"script", "link", "style", "img"}
    bold = re.findall(r"\*\*(.*?)\*\*", text)
    assert sorted(page.bold) == sorted(cell.replace("\\", "") for cell in bold)
    assert len(page.rows) == 1 + len(ROWS)
    rows = list(csv.reader(io.StringIO(comma_separated(TABLE))))
    assert float(rows[4][3]) == 1 / 3
    assert rows[1][4:6] == ["9", "10"]
    nasty = '<img src=x onerror="alert(1)">&'
    page = Page(html_fragment(Table("t", nasty, (Column(nasty),), ((nasty,),), nasty, nasty)))
    assert page.rows == [[nasty], [nasty]]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, records):
    """A folder with a report's records."""
    folder = tmp_path_factory.mktemp("recorded")
    RecordFile(folder / "report").append(records)
    return folder


@pytest.fixture
def folder(recorded, monkeypatch):
    monkeypatch.chdir(recorded)
    return recorded


def run(capsys, *arguments):
    code = cli.run_command(["report", *arguments])
    return code, *capsys.readouterr()


def test_the_list_of_a_table_names_its_columns(capsys, folder):
    code, out, _ = run(capsys, "--table", "accuracy", "--list")
    assert code == 0
    assert out.splitlines()[0] == "problem"
    assert "greatest is best" in out
    assert "folded" in out


@pytest.mark.parametrize(
    ("form", "begin"),
    [("md", "# Success"), ("tex", "% \\usepackage"), ("csv", "problem,"), ("html", "<figure")],
)
def test_a_table_goes_to_standard_output_or_to_a_file(capsys, folder, form, begin):
    arguments = ["--table", "accuracy", "--format", form]
    code, out, _ = run(capsys, *arguments)
    assert code == 0
    assert out.startswith(begin)
    assert run(capsys, "report", *arguments, "-o", "table")[:2] == (0, "table written\n")
    assert (folder / "table").read_text() == out
    assert not (folder / "report" / "index.html").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--table", "acuracy"], "did you mean 'accuracy'?"),
        (["--table", "accuracy", "--format", "pdf"], "unknown format 'pdf'"),
        (["--table", "accuracy", "--columns", "solvr"], "did you mean 'solver'?"),
        (["--table", "accuracy", "--rows", "solver=x"], "no row of accuracy passes"),
        (["--table", "accuracy", "-o", "report"], "expected a file for the table"),
        (["--columns", "solver"], "expected --table"),
        (["--rows", "solver=x"], "expected --table"),
        (["report", "-o", "other"], "expected --table"),
        (["nowhere", "--list"], "no records in nowhere"),
    ],
)
def test_misuse_exits_2_with_one_sentence(capsys, folder, arguments, sentence):
    code, out, err = run(capsys, *arguments)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_rows_and_columns_of_every_table_are_selected_by_their_own_names(records):
    """Those with rows of absent engines, too, about which nothing was measured."""
    every = sections.tables(Results(records))
    assert any(not source.suite for table in every for source in table.sources)
    for table in filter(lambda table: table.rows, every):
        headings = [column.heading for column in table.columns]
        whole = selected(table, [",".join(headings[::-1])], order=headings[0])
        assert sorted(map(str, whole.rows)) == sorted(str(row[::-1]) for row in table.rows)
        name = words(table.rows[-1][0])
        left = selected(table, headings[:1], [f"{headings[0]}={name}"], headings[-1])
        count = sum(words(row[0]) == name for row in table.rows)
        assert [words(cell) for (cell,) in left.rows] == [name] * count
