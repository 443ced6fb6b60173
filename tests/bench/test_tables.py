"""Tables: every format says the same, and nothing in a cell can break it."""

import csv
import io
import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plumbob.bench.measure.metrics import Share, share
from plumbob.bench.tables import writers
from plumbob.bench.tables.table import Column, Summary, Table, best_cells, words

HOSTILE = 'a|b & 50% of_x #1 {y} $z^2 ~ \\cmd <script>"quoted", `code` *star* [link](x)\nnext'


COLUMNS = (Column("name", words=True), Column("value", "m"))


def table(*rows, columns=COLUMNS):
    return Table("t", "Title", columns, rows)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1.0, "1.00"),
        (-0.0123456, "-0.0123"),
        (9.996, "10.0"),
        (123.4, "123"),
        (12345.6, "12,300"),
        (1e-5, "1.0e-5"),
        (9.98e-5, "1.0e-4"),
        (-4.4e-16, "-4.4e-16"),
        (2e9, "2.0e9"),
        (float("nan"), "not a number"),
        (float("inf"), "no answer"),
        (12345, "12,345"),
        (True, "yes"),
        (None, "–"),
        (share(np.array([True, False])), "1/2 = 50 % (9.5–90.5)"),
        ("two\nlines", "two lines"),
    ],
)
def test_words(value, text):
    assert words(value) == text


@pytest.mark.parametrize(
    ("unit", "value"),
    [("µs", 2e6), ("ns/particle", 2e9), ("°", 360 / np.pi), ("%", 200.0), ("m/s", 2.0), ("", 2.0)],
)
def test_a_column_converts_what_it_reads_to_its_unit(unit, value):
    assert Column("a", unit).cell(np.float64(2.0)) == pytest.approx(value, rel=1e-15)
    assert Column("a", unit).cell(np.int64(2)) == 2


@given(st.floats(-1e300, 1e300))
def test_a_number_in_words_is_near_itself(value):
    shown = float(words(value).replace(",", ""))
    assert abs(shown - value) <= 0.0500001 * abs(value)


def test_a_ragged_row_is_refused():
    with pytest.raises(ValueError, match="expected 2 cells in table t, got 1"):
        table(("single",))


def test_headings_that_stand_twice_are_refused():
    with pytest.raises(ValueError, match="distinct headings"):
        table(columns=(Column("a"), Column("a")))


def test_markdown_cells_cannot_end_a_cell_or_a_row():
    lines = writers.markdown(table((HOSTILE, 1.0))).splitlines()
    row = lines[-1]
    assert len(re.findall(r"(?<!\\)\|", row)) == 3
    assert not re.search(r"(?<!\\)[`*_\[\]<>]", row)


@pytest.mark.parametrize("number", ["2.7e-15", "-3.0", "+1", "0.5"])
def test_a_number_in_markdown_stays_as_it_is(number):
    assert f"| {number} |" in writers.markdown(table((number, 1.0)))


@pytest.mark.parametrize("name", ["- x", "+ x", "1. x", "1) x", "= x", "$x$"])
def test_a_point_in_markdown_begins_no_list_or_formula(name):
    answered = Table("t", "T", (Column("a"),), ((1,),), summary=Summary(name, (name,)))
    lines = writers.markdown(answered).splitlines()
    assert not any(re.match(r"(- )?([-+=$]|\d[.)]) ?x", line) for line in lines)


def test_csv_keeps_all_digits_and_any_text():
    third = 1 / 3
    columns = (Column("name", words=True), Column("value", "m"), Column("hits", note="95 %"))
    text = writers.comma_separated(
        table((HOSTILE, third, share(np.array([True]))), ("-", None, None), columns=columns)
    )
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0][:3] == ["name", "value_m", "hits_hits"]
    assert rows[1][0] == " ".join(HOSTILE.split())
    assert float(rows[1][1]) == third
    assert rows[1][2:4] == ["1", "1"]
    assert rows[2] == ["-", "", "", "", "", ""]


FORMULAS = ["=1+1", "+a", "-x", "@SUM(A1)", "-2+cmd|' /C calc'!A0", "\t=1", "\r\n=1", " =1", "-e5"]
FORMULAS += ["＝1", "'", "'=1", "''a", "--", "=5", '=HYPERLINK("http://x","y")']


@pytest.mark.parametrize("name", FORMULAS)
def test_a_text_in_csv_is_no_formula_and_less_one_apostrophe_the_text(name):
    columns = (Column("name", words=True), Column(name, words=True))
    text = writers.comma_separated(table((name, name), columns=columns))
    heads, row = csv.reader(io.StringIO(text))
    assert row[1][0] == "'"
    assert row[1].removeprefix("'") in (name, " ".join(name.split()))
    assert re.fullmatch("[a-z0-9_]+", heads[1])


@pytest.mark.parametrize("cell", [-1, -1.5, -1e-300, -math.inf, "-5", "-1.2e-5", "+.5", "-", "–"])
def test_a_number_in_csv_and_the_mark_of_none_stand_as_they_are(cell):
    kinds = (Column("a", words=True), Column("b", words=isinstance(cell, str)))
    text = writers.comma_separated(table(("-", cell), columns=kinds))
    assert list(csv.reader(io.StringIO(text)))[1] == ["-", str(cell)]


@pytest.mark.parametrize(
    ("title", "unit", "name"),
    [("time, median", "µs", "time_median_us"), ("distance to Newton’s solution", "m",
     "distance_to_newtons_solution_m"), ("solved", "%", "solved_percent"), ("2 / ω", "ms",
     "2_per_omega_ms"), ("solve", "ns/solve", "solve_ns_per_solve"), ("g", "kg m²", "g_kg_m2")],
)  # fmt: skip
def test_a_name_in_csv_is_an_identifier_with_its_unit(title, unit, name):
    assert writers.machine_name(title, unit) == name


def test_a_column_of_numbers_in_csv_keeps_its_texts_apart():
    columns = (Column("solver", words=True), Column("iterations"))
    text = writers.comma_separated(table(("a", 1234), ("b", "12 claimed"), columns=columns))
    assert text == "solver,iterations,iterations_remark\na,1234,\nb,,12 claimed\n"


def test_an_answer_stands_in_markdown_with_its_points():
    answered = Table("t", "T", (Column("a"),), ((1,),), summary=Summary("Thus:", ("x", "y")))
    assert "Thus:\n\n- x\n- y\n" in writers.markdown(answered)


def test_counts_have_separators_of_thousands():
    assert words(Share(1200, 2400, 0.48, 0.52)).startswith("1,200/2,400 = 50 %")
    assert words(1200) == words(1200.0) == "1,200"


@pytest.mark.parametrize("total", [2, 10, 999, 1000, 1001, 10_000, 123_456])
def test_a_share_is_all_or_nothing_only_where_it_is(total):
    def percent(hits):
        return words(Share(hits, total, 0.0, 1.0)).split(" = ")[1].split(" %")[0]

    assert percent(total) == "100"
    assert percent(0) == "0"
    assert percent(total - 1) != "100"
    assert percent(1) != "0"


def ranked(cells, best, **more):
    """Return the rows that are best in a column, of rows that are all compared."""
    columns = (Column("solver", words=True), Column("value", best=best))
    rows = tuple((f"solver {i}", cell) for i, cell in enumerate(cells))
    return {i for i, _ in best_cells(Table("t", "", columns, rows, compared=0, **more))}


@pytest.mark.parametrize("best", ["least", "greatest"])
def test_the_best_cell_is_the_extreme_one_and_whatever_is_written_like_it(best):
    for cells in itertools.product([None, "absent", 1.0, 1.0001, 2, float("nan")], repeat=3):
        numbers = [c for c in cells if isinstance(c, int | float) and c == c]
        extreme = {"least": min, "greatest": max}[best](numbers, default=0)
        wanted = {i for i, c in enumerate(cells) if c in numbers and words(c) == words(extreme)}
        assert ranked(cells, best) == (wanted if len(numbers) > len(wanted) else set())


def test_shares_tie_where_their_intervals_overlap():
    near, far = (share(np.arange(100) < hits) for hits in (95, 50))
    assert ranked([near, share(np.arange(100) < 97), far], "greatest") == {0, 1}


def test_a_row_that_is_cut_short_is_never_best():
    assert ranked([1.0, 2.0, 3.0], "least", unranked=frozenset([0])) == {1}


def test_a_column_without_a_best_has_none():
    assert ranked([1.0, 2.0], "") == set()
