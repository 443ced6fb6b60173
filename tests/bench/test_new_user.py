"""What a new user sees who enters a solver of chains that counts nothing, and asks for it only."""

import contextlib
import io
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

from plumbob.bench.experiments import SCALES, SUITES, blocks
from plumbob.bench.experiments.arm import accuracy, residuals_chart
from plumbob.bench.experiments.chain import beyond_reach, iterations_chart
from plumbob.bench.figures.sketch import drawn
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.page.headlines import absent
from plumbob.bench.page.sections import tables
from plumbob.bench.peers import opening
from plumbob.bench.peers.peer import Peer
from plumbob.bench.tables.results import Results, printable
from plumbob.bench.tables.table import words
from plumbob.bench.tables.user_solvers import solver_remarks
from plumbob.cli import selection
from plumbob.cli.main import run_command

PAGE = Path(__file__).parents[2] / "docs" / "bench.md"
IK = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)[1]
SILENT = IK.replace(', "iterations": k + 1', "").replace(
    'PLUMBOB = {"name": "My FABRIK", "version": "0.1"}', ""
)
CHAINS = {"task": "chain", "stratum": "beyond", "title": "every chain"}
NO_ROBOTS = "my_ik.py was not asked for robots: it offers no robot_inverse_kinematics"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the solver, and nobody's entry points."""
    made, before = tmp_path_factory.mktemp("new"), Path.cwd()
    (made / "my_ik.py").write_text(SILENT, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(opening, "installed", list)
        os.chdir(made)
        yield made
        os.chdir(before)


@pytest.fixture(scope="module")
def printed(folder):
    """What the first run prints."""
    problems = ("chain", "published/fabrik/reachable", "robots/all")
    asked = [word for name in problems for word in ("--problem", name)]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        run_command(["bench", "ik", "--quick", "--targets", "2", "--with", "my_ik.py",
                     "--solver", "my_ik.py", *asked, "-o", "out"])  # fmt: skip
    return out.getvalue()


@pytest.fixture(scope="module")
def records(printed):
    return [printable(one) for one in RecordFile("out").read().records]


@pytest.fixture(scope="module")
def made(records):
    return {table.name: table for table in tables(Results(records), ["ik"])}


def test_iterations_that_nobody_counts_are_not_reported_and_no_number(printed, made):
    assert "not a number" not in printed
    assert "iterations not reported" in made["published_ik"].rows[0]
    for name in ("accuracy", "q1_beyond_reach", "published_ik"):
        (row, *_) = made[name].rows
        said = {c.heading: words(v) for c, v in zip(made[name].columns, row, strict=True)}
        counts = [v for h, v in said.items() if h.startswith("iterations, ") or "measured" in h]
        assert set(counts) == {"–"}, name
        assert "not a number" not in said.values()


def test_who_counts_nothing_has_no_curve_over_iterations(records):
    results = Results(records)
    assert iterations_chart(results) is None
    assert "my_ik.py" in drawn(residuals_chart(results)).svg


def test_peers_that_were_not_asked_are_not_said_to_be_missing(printed, records, made):
    assert "not installed" not in printed
    assert made["participants"].rows == ()
    assert absent(Results(records)) == []


def test_who_offers_no_robots_gets_a_sentence_and_no_table_of_dashes(printed, made):
    assert printed.count(NO_ROBOTS) == 1
    assert "Robots" not in printed
    assert made["robots_by_robot"].rows == ()
    table = made["entered"]
    assert table.columns[-1].title == "remark"
    assert NO_ROBOTS.removeprefix("my_ik.py was ").rstrip(".") in table.rows[0][-1]


def test_who_offers_no_chains_has_no_row_of_numbers_there(make):
    none = make.record("ik", "chain/all", "Mine", {}, facts={**CHAINS, "entrant": True},
                       notes={"remark": "not asked for chains: it offers nothing"})  # fmt: skip
    results = Results([none, make.beyond("ccd", 0.5)])
    assert [row[1] for row in beyond_reach(results).rows] == ["CCD"]
    assert accuracy(results).rows == ()
    (sentence,) = solver_remarks(results, ["ik"])
    assert sentence == "Mine was not asked for chains: it offers nothing."


def listed(*suites):
    """The lines of a list, by what they begin with."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert run_command(["bench", *suites, "--list", "--with", "my_ik.py"]) == 0
    return out.getvalue().splitlines()


def test_the_list_of_a_suite_names_each_problem_once_and_lines_up(folder):
    lines = listed("ik")
    assert "  chain/near" in lines
    assert not any(line.startswith("  robots/all") for line in lines)
    titled = [line for line in lines if re.match(r"  (robots|unreachable)/(panda|pr2)  ", line)]
    assert len({len(line) - len(line.split("  ")[-1].strip()) for line in titled}) == 1
    assert all(line.endswith(("  Franka Panda", "  PR2, right arm")) for line in titled)
    text = "\n".join(lines)
    groups = dict(re.findall(r"^solvers of (.*)\n((?:  .*\n?)+)", text, re.MULTILINE))
    solvers = [line for group in groups.values() for line in group.splitlines()]
    said = {line.split("  ")[1]: line.split("  ")[-1].strip() for line in solvers}
    assert said["my_ik.py"] == "entered, my_ik.py"
    assert re.fullmatch(r"\d+\.\d+\S*", said["Plumbob LM, first phase"])
    assert re.fullmatch(r"\d+\.\d+\S*", said["ccd"])
    assert set(said) >= {"mink", "TRAC-IK, 5 ms"}
    for group in groups.values():
        assert len({line.rindex("  ") for line in group.splitlines()}) == 1
    mine = next(problems for problems, group in groups.items() if "  my_ik.py" in group)
    assert mine == "chain (4); published (2)"
    ours = "  Plumbob LM, 14 restarts  "
    lm = next(problems for problems, group in groups.items() if ours in group)
    assert re.fullmatch(r"robots \(\d+\); unreachable \(\d+\); published \(\d\)", lm)


def test_a_peer_that_is_missing_is_listed_as_such(folder, monkeypatch):
    monkeypatch.setattr(Peer, "version", "")
    (line,) = [line for line in listed("ik") if line.startswith("  mink  ")]
    assert line.endswith("  not installed")


@pytest.mark.parametrize(
    ("asked", "is_named"),
    [({"robots": ["ur5"]}, True), ({"problems": ["chain"]}, False), ({"solvers": ["ccd"]}, False)],
)
def test_a_part_of_the_robots_names_absent_peers_and_no_other_part_does(
    folder, monkeypatch, asked, is_named
):
    version = property(lambda peer: "" if peer.title == "mink" else "1")
    monkeypatch.setattr(Peer, "version", version)
    choice = selection.choose(["ik"], "quick", selection.MeasurementRequest(**asked))
    solvers = {block.solver for block in filter(choice.takes, blocks("ik", choice.scale))}
    assert ("mink" in solvers) == is_named


def test_the_list_of_all_suites_has_few_lines_with_suites_as_headings(folder, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    lines = listed()
    headings = [line.partition(":")[0] for line in lines if line and line[0] != " "]
    assert headings[: len(SUITES)] == list(SUITES)
    assert len(lines) <= 5 * len(SUITES) + 1
    assert max(map(len, lines)) <= 100
    assert lines[-1] == "All problems and solvers of a suite: plumbob bench SUITE --list"
    assert "joint positions, Pinocchio; " in "\n".join(lines)
    assert "joint positions, Pinocchio joint" not in "\n".join(lines)


def test_entrants_may_make_as_many_iterations_as_ours(folder, records, made):
    entrants = opening.open_solvers(opening.addresses(["my_ik.py"]), ["ik"])
    scale = replace(SCALES["quick"], targets=2, user_solvers=tuple(entrants))
    asked: dict[str, dict[str, object]] = {}
    for block in blocks("ik", scale):
        if block.problem.startswith(("chain/", "published/fabrik")) and "max_iterations" in (
            block.settings
        ):
            asked.setdefault(block.problem, {})[block.solver] = {
                name: block.settings[name] for name in ("tolerance", "max_iterations")
            }
    assert len(asked) == 6
    for problem, limits in asked.items():
        assert limits["my_ik.py"] == limits["ccd"], problem


@pytest.mark.parametrize("name", ["accuracy", "q1_beyond_reach"])
def test_tables_say_how_many_iterations_each_may_make_and_who_was_cut_short(made, name):
    (j,) = [j for j, one in enumerate(made[name].columns) if one.title == "iterations allowed"]
    assert {row[j] for row in made[name].rows} == {1000}
    assert not made[name].columns[j].folded
    assert any(one.title == "remark" for one in made[name].columns)
