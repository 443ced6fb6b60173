"""Courses over many runs, on a terminal and as a figure."""

from dataclasses import replace

import numpy as np
import pytest

from plumbob.bench.comparison.history import BLOCKS, courses, read_runs, sparkline
from plumbob.bench.harness.record import RecordFile
from plumbob.cli import main as cli


@pytest.fixture
def runs(tmp_path, monkeypatch, make):
    """Four runs in which one row of eight gets twice as slow and one is measured twice only."""
    monkeypatch.chdir(tmp_path)
    for i in range(4):
        when = f"2000-01-0{i + 1}T00:00:00+00:00"
        made = [
            make.timed(f"s{j}", 1e-6 * (1 + (j == 3) * i / 3), work=f"$w_{j}") for j in range(8)
        ]
        made += [make.timed("late", 1e-3)] if i > 1 else []
        conditions = {"commit": f"{i}" * 40}
        records = [replace(record, when=when, conditions=conditions) for record in made]
        RecordFile(f"run{i}").append(records)
    return [tmp_path / f"run{i}" for i in (2, 0, 3, 1)]


def test_a_sparkline_has_a_block_a_value():
    assert sparkline(np.arange(8.0)) == BLOCKS
    assert sparkline(np.array([1.0, np.nan, 2.0])) == f"{BLOCKS[0]}·{BLOCKS[-1]}"
    assert sparkline(np.array([5.0, 5.0])) == BLOCKS[0] * 2


def test_runs_come_in_the_order_of_time_and_the_greatest_change_first(runs):
    read = read_runs(runs)
    assert [run.name for run in read] == [f"run{i} {str(i) * 7}" for i in range(4)]
    made = courses(read, "seconds")
    assert len(made) == 9
    assert made[0].solver == "s3"
    assert np.exp(made[0].change) == pytest.approx(2.0)
    late = next(course for course in made if course.solver == "late")
    assert np.isnan(late.medians).tolist() == [True, True, False, False]


def test_the_command_prints_sparklines_and_draws(capsys, runs, tmp_path):
    folders = [run.name for run in runs]
    assert cli.run_command(["history", *folders, "--only", "s", "-o", "h.svg"]) == 0
    _, title, _, first, *_ = capsys.readouterr().out.splitlines()
    assert title.startswith("seconds, 4 runs: run0 0000000, run1")
    assert first.split()[-5:] == ["s3", "2.0e-6", "4.0e-6", "2.00", sparkline(np.arange(4.0))]
    svg = (tmp_path / "h.svg").read_text()
    assert svg.count("<svg") == 1
    assert "run3 3333333" in svg


MISUSE = {
    "no folder": ([], "FOLDER"),
    "no records": (["nowhere"], "no records in nowhere"),
    "quantity": (["run0", "--quantity", "speed"], "quantity: expected one of moved, seconds, got"),
    "nothing": (["run0", "--only", "x y"], "only: expected part of a problem or solver, got 'x y'"),
    "suffix": (["run0", "-o", "a.png"], "--output: expected a file that ends with .svg"),
}


@pytest.mark.parametrize(("arguments", "sentence"), MISUSE.values(), ids=MISUSE)
def test_misuse_of_history_exits_2_with_one_sentence(capsys, runs, arguments, sentence):
    assert cli.run_command(["history", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert sentence in err
