"""Two revisions side by side: with itself one differs in nothing, planted faults are found."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from bench import cli
from bench.comparison.rerun import Plan, rerun
from bench.comparison.rows import Verdict
from bench.harness import machine

LOOPS = 20_000
# A bench of two rows, as far as a rerun asks for one and in lines that start at once: work of a
# length, and an answer.
EXPERIMENTS = """
from time import perf_counter
LOOPS, DIGIT = {loops}, {digit}
SUITES, SCALES = {{"timing": ""}}, {{"quick": None}}

def took(loops):
    begin = perf_counter()
    sum(range(loops))
    return perf_counter() - begin

def measure(solver):
    loops = LOOPS if solver == "ours" else {usual}
    return {{"seconds": [took(loops) for _ in range(15)], "residual": [0.25, DIGIT]}}

def blocks(suite, scale):
    print("an engine speaks")
    return ["ours", "steady"]
"""
RUN = """
from ..experiments import measure as arrays
def block_key(block):
    return "timing", "p", block, "{}"
def measure(block):
    return {"suite": "timing", "problem": "p", "solver": block, "arrays": arrays(block)}
"""
RECORD = """
import json
REST = {"settings": {}, "size": 0, "notes": {}, "stamp": {}, "when": "", "seconds": 0}
def encode(record):
    return json.dumps({"format": 1, **record, **REST})
"""


def git(folder, *arguments):
    identity = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    subprocess.run(["git", "-C", str(folder), *identity, *arguments], check=True)


def write(folder, loops=LOOPS, digit=0.5):
    text = EXPERIMENTS.format(loops=loops, digit=repr(float(digit)), usual=LOOPS)
    (folder / "bench" / "experiments" / "__init__.py").write_text(text)


@pytest.fixture
def repository(tmp_path):
    """A clone whose one commit is tagged `before`, with the small bench in it."""
    folder = tmp_path / "clone"
    for name in ("bench/experiments", "bench/harness"):
        (folder / name).mkdir(parents=True)
    for name in ("bench", "bench/harness"):
        (folder / name / "__init__.py").write_text("")
    (folder / "bench" / "harness" / "record.py").write_text(RECORD)
    (folder / "bench" / "harness" / "run.py").write_text(RUN)
    write(folder)
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-q", "-m", "before")
    git(folder, "tag", "before")
    return folder


def side_by_side(folder, seed=1, **plan):
    return rerun(Plan("before", ("timing",), seed=seed, **plan), folder)


def called(made):
    return {
        (row.key[2], row.quantity): row.verdict
        for row in made.rows if row.verdict in (Verdict.FASTER, Verdict.SLOWER)
    }  # fmt: skip


def worktrees(folder):
    listed = subprocess.run(
        ["git", "-C", str(folder), "worktree", "list"], check=True, capture_output=True, text=True
    )
    return len(listed.stdout.splitlines())


def test_a_revision_beside_itself_answers_alike(repository):
    made = side_by_side(repository, pairs=2)
    answers = [row.verdict for row in made.rows if row.quantity != "seconds"]
    assert answers == [Verdict.SAME] * 2
    assert worktrees(repository) == 1


@pytest.mark.slow
def test_a_revision_beside_itself_is_neither_faster_nor_slower(repository):
    made = [side_by_side(repository, seed) for seed in range(20)]
    assert sum(bool(called(one)) for one in made) <= 1


def test_a_planted_digit_is_first_of_all(repository):
    write(repository, loops=2 * LOOPS, digit=np.nextafter(0.5, 1.0))
    made = side_by_side(repository, pairs=2)
    assert [row.verdict for row in made.rows[:2]] == [Verdict.LESS_RIGHT] * 2
    assert made.rows[0].quantity == "residual"
    assert "2 times each" in made.how


@pytest.mark.slow
def test_a_planted_fifth_is_found(repository):
    write(repository, loops=LOOPS * 6 // 5)
    made = side_by_side(repository, pairs=14)
    assert called(made) == {("ours", "seconds"): Verdict.SLOWER}
    ratio = next(row.ratio for row in made.rows if row.key[2] == "ours" and row.ratio)
    assert ratio.low < 1.2 < 1.1 * ratio.high


def test_only_what_is_asked_for_is_measured(repository):
    made = side_by_side(repository, words=("stead",), pairs=2)
    assert {row.key[2] for row in made.rows} == {"steady"}
    with pytest.raises(ValueError, match="something to measure in both revisions, got nothing"):
        side_by_side(repository, words=("no such solver",))


def test_a_process_that_ends_is_said_to_and_nothing_is_left(repository):
    (repository / "bench" / "experiments" / "__init__.py").write_text("raise OSError('broken')")
    with pytest.raises(ValueError, match="a process of the rerun ended: OSError: broken"):
        side_by_side(repository)
    assert worktrees(repository) == 1


def test_the_command_says_what_it_does_and_exits_1(capsys, repository, monkeypatch):
    monkeypatch.setattr(machine, "ROOT", repository)
    write(repository, digit=0.75)
    arguments = ["--rerun", "before", "--fail", "accuracy", "--pairs", "2"]
    code = cli.run_command(["compare", *arguments])
    out, err = capsys.readouterr()
    assert code == 1
    assert out.splitlines()[0] == "STOP: 2 rows beyond the limits of --fail"
    assert "plumbob: pair 2 of 2" in err


@pytest.mark.slow
def test_this_revision_beside_itself_differs_in_nothing():
    """The real bench, its working copy beside its last commit, on two rows of timing."""
    root = Path(machine.__file__).parents[2]
    made = rerun(Plan("HEAD", ("timing",), ("10 balls/one pose",)), root)
    assert len(made.rows) >= 4
    assert called(made) == {}
