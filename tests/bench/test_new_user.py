"""What a new user sees who enters a solver of chains that counts nothing, and asks for it only."""

import contextlib
import io
import os
import re
from pathlib import Path

import pytest

from bench.cli import run_command
from bench.entrants import opening
from bench.experiments.chain import figures
from bench.harness.record import RecordFile
from bench.presentation.figures import drawn
from bench.presentation.results import Results, plain
from bench.presentation.sections import tables
from bench.presentation.tables import words

PAGE = Path(__file__).parents[2] / "docs" / "bench.md"
IK = re.search(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)[1]
SILENT = IK.replace(', "iterations": k + 1', "").replace(
    'PLUMBOB = {"name": "My FABRIK", "version": "0.1"}', ""
)
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
    problems = ("chain", "published/fabrik", "robots/all")
    asked = [word for name in problems for word in ("--problem", name)]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        run_command(["bench", "ik", "--quick", "--targets", "2", "--with", "my_ik.py",
                     "--solver", "my_ik.py", *asked, "-o", "out"])  # fmt: skip
    return out.getvalue()


@pytest.fixture(scope="module")
def records(printed):
    return [plain(one) for one in RecordFile("out").read().records]


@pytest.fixture(scope="module")
def made(records):
    return {table.name: table for table in tables(Results(records), ["ik"])}


def test_iterations_that_nobody_counts_are_unsaid_and_no_number(printed, made):
    assert "not a number" not in printed
    assert "iterations unsaid here" in made["published_fabrik"].summary.points[0]
    for name in ("accuracy", "q1_beyond_reach", "published_fabrik"):
        (row, *_) = made[name].rows
        said = {c.heading: words(v) for c, v in zip(made[name].columns, row, strict=True)}
        counts = [v for h, v in said.items() if "iteration" in h or "here" in h]
        assert set(counts) == {"–"}, name
        assert "not a number" not in said.values()


def test_who_counts_nothing_has_no_curve_over_iterations(records):
    results = Results(records)
    assert figures.iterations(results) is None
    assert "my_ik.py" in drawn(figures.ik_residuals(results)).svg
