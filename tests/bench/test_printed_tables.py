"""What commands print is what the data say: tables are read back, at any width and in a pipe."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import printed_table
import pytest

from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page import sections
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.table import is_blank, without_empty, words
from plumbob.cli import main as cli
from plumbob.cli import terminal
from plumbob.crosscheck.claims import CLAIMS
from plumbob.crosscheck.verdict import ClaimVerdict
from plumbob.verify.judgement import Verdict as TaskVerdict
from plumbob.verify.screen import terminal as verify_terminal

# Of a terminal; None is a pipe.
WIDTHS = (80, 120, 200, None)


@pytest.fixture(params=WIDTHS, ids=["80", "120", "200", "pipe"])
def width(request, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    if request.param:
        monkeypatch.setenv("COLUMNS", str(request.param))
    return request.param


def plumbob(capsys, *arguments):
    code = cli.run_command(list(arguments))
    out, err = capsys.readouterr()
    assert err == ""
    return code, out


def assert_printed(lines, headings, rows, width):
    """The printed columns hold the headings and cells of the data, letter by letter, in order.

    In a pipe each row is one line. On a terminal columns may be missing, in the order of the data.
    """
    data = {
        letters(h, *cells): i for i, (h, *cells) in enumerate(zip(headings, *rows, strict=True))
    }
    printed = [letters(*column) for column in printed_table.columns(lines)]
    assert set(printed) <= set(data)
    places = [data[column] for column in printed]
    assert places == sorted(places)
    if width is None:
        assert printed_table.rows(lines) == [list(headings), *map(list, rows)]
    else:
        assert max(map(len, lines)) <= width
    return [headings[i] for i in places]


letters = printed_table.letters


def assert_table_printed(out, table, width):
    """A whole table is printed below what it says; return the headings that stand there."""
    shown = without_empty(table)
    unfolded = [j for j, c in enumerate(shown.columns) if width or not c.folded or not j]
    headings = [shown.columns[j].heading for j in unfolded]
    rows = [[words(row[j]) for j in unfolded] for row in shown.rows]
    about = (table.title, table.summary.sentence, *table.summary.points)
    return assert_printed(printed_table.below(out, about), headings, rows, width)


@pytest.fixture
def verdicts(monkeypatch):
    """Verdicts of all claims, no two numbers of a row alike; two are missed."""
    forces = list(CLAIMS).index("spring forces")
    failures = {3: "nothing moved", forces: "not a number"}
    made = [
        ClaimVerdict(claim, 3 + i, claim.tolerance.value / (2 + 3 * i), 1.0, failures.get(i, ""))
        for i, claim in enumerate(CLAIMS.values())
    ]
    made[forces] = replace(made[forces], difference=float("nan"))
    monkeypatch.setattr("plumbob.crosscheck.claims.run_claims", lambda *_: made)
    return made


def test_check_prints_each_verdict_under_its_heading(capsys, verdicts, width):
    code, out = plumbob(capsys, "check")
    headings = ["claim", "verdict", "cases", "largest difference", "tolerance"]
    headings += ["tolerance used [%]"]
    rows = [
        [
            v.claim.name, "MISSED" if v.failure else "held", str(v.cases), words(v.difference),
            words(v.claim.tolerance.value), words(100 * v.difference / v.claim.tolerance.value),
        ]
        for v in verdicts
    ]  # fmt: skip
    assert assert_printed(printed_table.below(out, ()), headings, rows, width) == headings
    assert code == 1
    assert out.splitlines()[-3:] == [
        "MISSED: IK answers, Pinocchio (nothing moved)",
        "MISSED: spring forces (not a number)",
        f"{len(verdicts) - 2} of {len(verdicts)} claims held",
    ]


def test_every_table_of_a_suite_is_printed_as_it_is(capsys, tmp_path, records, width):
    RecordFile(tmp_path).append(records)
    every = sections.tables(Results(records))
    terminal.print_tables([record.suite for record in records], tmp_path)
    out = capsys.readouterr().out
    for table in every:
        if not is_blank(table):
            shown = assert_table_printed(out, table, width)
            left = [c.heading for c in without_empty(table).columns if c.heading not in shown]
            assert all(letters(heading) in letters(out) for heading in left)
    assert not re.search(r"\\[_*<|]", out)


def test_only_tables_of_the_suites_with_rows_are_printed_and_brackets_are_no_markup(
    capsys, tmp_path, records
):
    RecordFile(tmp_path / "empty").append([])
    terminal.print_tables(["ik"], tmp_path / "empty")
    assert capsys.readouterr().out == ""
    RecordFile(tmp_path).append(records)
    terminal.print_tables(["timing"], tmp_path)
    out = capsys.readouterr().out
    assert "[ns]" in out
    assert "Robots one by one" not in out


def test_records_are_listed_as_counted(capsys, tmp_path, monkeypatch, make, width):
    monkeypatch.chdir(tmp_path)
    stamp = {"machine": {"processor": "abacus", "cores": 2, "memory_gib": None, "system": "x86_64"}}
    made = [make.drawn(solver, warm, 1.0) for solver in ("my_ik", "ccd") for warm in (True, False)]
    made = [replace(record, stamp=stamp, conditions={"commit": "a" * 40}) for record in made]
    made[0] = replace(made[0], measured={"failed": "no"}, conditions={})
    RecordFile(tmp_path / "report").append(made)
    code, out = plumbob(capsys, "records", "list")
    about = ("Records in report", "4 records, measured on abacus, 2 cores, x86_64")
    headings = ["suite", "solver", "records", "failed", "superseded", "latest", "commits"]
    rows = [["arm", "my_ik", "2", "1", "0"], ["arm", "ccd", "2", "0", "0"]]
    rows = [[*row, made[0].when, "aaaaaaa"] for row in rows]
    shown = assert_printed(printed_table.below(out, about), headings, rows, width)
    assert code == 0
    assert set(headings) - set(shown) <= {"commits"}


def test_files_are_listed_with_what_each_engine_reads(capsys, tmp_path, monkeypatch, width):
    from plumbob.crosscheck.engines.file_kind import BVH, FRAGMENT, MJCF, URDF
    from plumbob.crosscheck.robots import files

    def checked(name, kind, *readings):
        file = files.ModelFile(tmp_path / "robots" / name, kind, tmp_path / "robots")
        return files.CheckedFile(file, tuple(files.FileReading(*reading) for reading in readings))

    every = [
        checked("my_arm.urdf", URDF, ("MuJoCo", files.AGREES, 2e-16), ("Pinocchio", files.UNREAD)),
        checked("b.xml", MJCF, ("Pinocchio", files.DIFFERS, 0.5), ("MuJoCo", files.AGREES, 3e-15)),
        checked("walk.bvh", BVH, ("second reader", files.AGREES, 4e-14)),
        checked("part.xml", FRAGMENT),
    ]
    found = files.FileSelection(tuple(one.file for one in every), 1)
    monkeypatch.setattr(files, "find", lambda paths: found)
    monkeypatch.setattr(files, "check", lambda given: every)
    code, out = plumbob(capsys, "check", "--files", "robots")
    assert code == 1
    assert out.splitlines()[:3] == [
        "robots/my_arm.urdf (URDF): MuJoCo agrees (2.0e-16); Pinocchio not read",
        "robots/b.xml (MJCF): Pinocchio differs (0.500); MuJoCo agrees (3.0e-15)",
        "robots/walk.bvh (BVH): second reader agrees (4.0e-14)",
    ]
    about = "In 3 files 1 reading disagrees; 1 is a part that others include, 1 XML file is of "
    headings = ["format", "compared with", "files"]
    headings += ["agrees", "differs", "not read", "largest difference"]
    rows = [
        ["URDF", "Pinocchio", "1", "0", "0", "1", "–"],
        ["URDF", "MuJoCo", "1", "1", "0", "0", "2.0e-16"],
        ["MJCF", "Pinocchio", "1", "0", "1", "0", "–"],
        ["MJCF", "MuJoCo", "1", "1", "0", "0", "3.0e-15"],
        ["BVH", "second reader", "1", "1", "0", "0", "4.0e-14"],
    ]
    lines = printed_table.below(out, (about, "other kinds"))
    assert assert_printed(lines, headings, rows, width) == headings


def test_compare_prints_whole_sentences_in_ten_lines(capsys, tmp_path, monkeypatch, make, width):
    monkeypatch.chdir(tmp_path)
    old = [make.drawn(f"solver {i}", False, 1.0) for i in range(12)]
    number = 3e-4 * (1 + 1e-13)
    new = [r.with_measured(residual=np.full(3, number)) for r in old]
    old = [r.with_measured(residual=np.full(3, 3e-4)) for r in old]
    RecordFile(tmp_path / "old").append(old)
    RecordFile(tmp_path / "new").append(new)
    code, out = plumbob(capsys, "compare", "old", "new")
    lines = out.splitlines()
    assert code == 0
    assert len(lines) <= 10
    assert width is None or max(map(len, lines)) <= width
    assert "…" not in out
    assert lines[:2] == ["12 rows worse", "12 LESS RIGHT"]
    sentences = re.split(r"LESS RIGHT ", " ".join(" ".join(lines[2:]).split()))[1:]
    more = 12 - len(sentences)
    assert f"and {more} more: --markdown FILE or --json FILE writes all" in sentences[-1]
    solvers = [re.match(r"arm/circle, (solver \d+), residual: (.*?), now (\S+)", s).groups()
               for s in sentences]  # fmt: skip
    assert len({solver for solver, *_ in solvers}) == len(sentences) > 2
    assert {pair[1:] for pair in solvers} == {("0.0003", "0.00030000000000002995")}


def test_verify_prints_a_line_a_task_under_its_heading():
    def task(name, verdict, digits, passed, total, slowdown, untimed=None):
        judgements = [SimpleNamespace(verdict=TaskVerdict.RIGHT)] * passed
        judgements += [SimpleNamespace(verdict=TaskVerdict.WRONG)] * (total - passed)
        return SimpleNamespace(task=name, method="", verdict=verdict, digits=digits,
                               judgements=judgements, slowdown=slowdown,
                               untimed=untimed)  # fmt: skip

    tasks = [
        task("energy", TaskVerdict.RIGHT, 15.34, 28, 28, 19.0),
        task("robot_inverse_kinematics", TaskVerdict.WRONG, None, 3, 7, None),
        task("track", TaskVerdict.RIGHT, None, 7, 7, None, "Not timed: no seconds."),
    ]
    lines = verify_terminal._table(tasks, str)
    assert printed_table.rows(lines) == [
        ["task", "verdict", "digits", "cases passed", "vs. reference"],
        ["energy", "RIGHT", "15.3", "28/28", "19 times slower"],
        ["robot_inverse_kinematics", "WRONG", "–", "3/7", "–"],
        ["track", "RIGHT", "–", "7/7", "not timed"],
    ]


def test_the_list_of_tables_says_how_large_each_is(capsys, tmp_path, monkeypatch, records, width):
    monkeypatch.chdir(tmp_path)
    RecordFile(tmp_path / "report").append(records)
    code, out = plumbob(capsys, "report", "--list")
    tables = sections.tables(Results(records))
    headings = ["table", "title", "rows", "columns"]
    rows = [[t.name, t.title, str(len(t.rows)), str(len(t.columns))] for t in tables]
    assert assert_printed(out.splitlines(), headings, rows, width) == headings
    assert code == 0


@pytest.mark.parametrize("width", [80, None], indirect=True)
def test_the_list_of_suites_cuts_no_name_and_counts_those_left_out(capsys, width):
    out = plumbob(capsys, "bench", "--list")[1]
    names = [claim.name for claim in CLAIMS.values()]
    assert "…" not in out
    assert width is None or all(len(line) <= width for line in out.splitlines() if line[0] == " ")
    text = " ".join(out.split())
    listed, more = re.search(rf"{len(names)} problems: (.*?) and (\d+) more", text).groups()
    assert listed.split("; ") == names[: len(names) - int(more)]
