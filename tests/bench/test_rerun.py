"""Two revisions side by side: with itself one differs in nothing, planted faults are found."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from plumbob.bench.compare import rerun as rerunning
from plumbob.bench.compare.rerun import PREFIX, Plan, _temporary_folder, rerun
from plumbob.bench.compare.rows import ChangeVerdict, Pair, TimeRatio, row_key
from plumbob.bench.compare.times import time_change
from plumbob.cli import main as cli

KEY = ("timing", "p", "mine", "{}")
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
# One that starts a process of its own and then works for longer than any test.
ENDLESS = """

def measure(solver):
    import os, pathlib, subprocess, time
    child = subprocess.Popen(["sleep", "600"])
    with open(os.environ["PIDS"], "a") as file:
        print(os.getpid(), child.pid, file=file, flush=True)
    time.sleep(600)
"""
RUN = """
from ..experiments import measure as arrays
def block_key(block):
    return "timing", "p", block, "{}"
def measure(block):
    return {"suite": "timing", "problem": "p", "solver": block, "measured": arrays(block)}
"""
RECORD = """
import json
REST = {"settings": {}, "size": 0, "stamp": {}, "when": "", "seconds": 0, "conditions": {}}
def encode(record):
    return json.dumps({"format": 4, **record, **REST})
"""


def git(folder, *arguments):
    identity = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    subprocess.run(["git", "-C", str(folder), *identity, *arguments], check=True)


def write(folder, loops=LOOPS, digit=0.5):
    text = EXPERIMENTS.format(loops=loops, digit=repr(float(digit)), usual=LOOPS)
    (folder / "bench" / "experiments" / "__init__.py").write_text(text)


@pytest.fixture
def repository(tmp_path, request):
    """A clone whose one commit is tagged `before`, with the small bench in it."""
    folder, room = tmp_path / "clone", getattr(request, "param", "measure")
    files = {"record": RECORD, "run": RUN, "__init__": "", "../__init__": ""}
    for name in ("experiments", room):
        (folder / "bench" / name).mkdir(parents=True)
    for name, text in files.items():
        (folder / "bench" / room / f"{name}.py").write_text(text)
    (folder / "pyproject.toml").write_text('[project]\nname = "plumbob"\n')
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
        for row in made.rows if row.verdict in (ChangeVerdict.FASTER, ChangeVerdict.SLOWER)
    }  # fmt: skip


def worktrees(folder):
    listed = subprocess.run(
        ["git", "-C", str(folder), "worktree", "list"], check=True, capture_output=True, text=True
    )
    return len(listed.stdout.splitlines())


@pytest.fixture
def temporary(tmp_path):
    """The folder for temporary files of the processes that `start` starts."""
    (tmp_path / "temporary").mkdir()
    return tmp_path / "temporary"


@pytest.fixture
def start(repository, temporary):
    """Return the function that starts the command in the clone, as a shell does."""
    processes = []
    environment = {
        **os.environ, "TMPDIR": str(temporary), "PIDS": str(temporary.with_name("pids"))
    }  # fmt: skip

    def begin(*arguments, program=(sys.executable, "-P", "-m", "plumbob")):
        words = [*program, "compare", "--rerun", "before", *arguments]
        process = subprocess.Popen(
            words, cwd=repository, env=environment, process_group=0, stderr=subprocess.PIPE,
            text=True, preexec_fn=let_signals_end,
        )  # fmt: skip
        processes.append(process)
        return process

    yield begin
    for process in processes:
        process.kill()
        process.communicate()


def let_signals_end():
    """What started pytest may ignore some, and what a process ignores its children ignore too."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def eventually(condition):
    """Whether a condition comes true in a minute; a busy machine may take long to get there."""
    deadline = time.monotonic() + 60.0
    while not (value := condition()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return value


def is_running(pid):
    status = Path(f"/proc/{pid}/status")
    return status.exists() and "State:\tZ" not in status.read_text()


def measure_endlessly(repository):
    with (repository / "bench" / "experiments" / "__init__.py").open("a") as file:
        file.write(ENDLESS)
    git(repository, "commit", "-q", "-a", "-m", "endless")
    git(repository, "tag", "-f", "before")


@pytest.mark.parametrize("repository", ["harness", "measure"], indirect=True)
def test_a_revision_beside_itself_answers_alike_and_one_pair_tells_no_drift(repository):
    made = side_by_side(repository, words=("stead",), pairs=1)
    assert {row.key[2] for row in made.rows} == {"steady"}
    assert [row.verdict for row in made.rows if row.quantity != "seconds"] == [ChangeVerdict.SAME]
    assert made.drift.sentence == "10.5 % (assumed: one pair does not measure it)"
    assert worktrees(repository) == 1


def test_a_planted_digit_is_first_of_all(repository):
    write(repository, loops=2 * LOOPS, digit=np.nextafter(0.5, 1.0))
    made = side_by_side(repository, pairs=2)
    assert [row.verdict for row in made.rows[:2]] == [ChangeVerdict.LESS_RIGHT] * 2
    assert made.rows[0].quantity == "residual"
    assert "2 times each" in made.method


class CountedBench:
    """Two revisions of which the new one takes twice as long, and the orders of their calls."""

    def __init__(self, records, **plan):
        self.plan, self.records = Plan("before", ("timing",), **plan), records
        self.starts, self.calls = [], []

    def tell(self, message):
        pass

    @contextlib.contextmanager
    def processes(self, order=(0, 1)):
        self.starts.append(tuple(order))
        self.calls.append([])
        yield tuple(SimpleNamespace(blocks=list, measure=partial(self.measure, i)) for i in (0, 1))

    def measure(self, revision, key):
        self.calls[-1].append((revision, key))
        (record,) = (r for r in self.records if r.key == key)
        seconds = np.full(5, 1.0 + revision)
        return replace(record, measured={"seconds": seconds})


def test_the_ratio_is_that_of_the_new_time_to_the_old_and_orders_are_drawn(make):
    """Of 60 draws each order comes at least 15 times, but for one chance in 10,000."""
    records = [make.timed(solver, 1.0) for solver in ("a", "b", "c")]
    rows = {row_key(record): Pair(record, record) for record in records}
    bench = CountedBench(records, pairs=60, seed=1)
    times = rerunning._measure_times(bench, rows)
    assert times == {(key, "seconds"): [(1.0, 2.0)] * 60 for key in rows}
    for key, ratio in rerunning._ratios(times).items():
        assert ratio.ratio == pytest.approx(2.0)
        assert time_change(*key, ratio, ratio.chance).verdict is ChangeVerdict.SLOWER
    firsts = [calls[k][0] for calls in bench.calls for k in (0, 2, 4)]
    rows_first = [calls[0][1] for calls in bench.calls]
    for order in (0, 1):
        assert 15 <= [first for first, _ in bench.starts].count(order) <= 45
        assert 45 <= firsts.count(order) <= 135
    assert all(8 <= rows_first.count(record.key) <= 34 for record in records)
    again, other = (CountedBench(records, pairs=60, seed=seed) for seed in (1, 2))
    for repeated in (again, other):
        rerunning._measure_times(repeated, rows)
    assert again.calls == bench.calls
    assert other.calls != bench.calls


def test_a_time_is_decided_where_two_measurements_agree_on_its_direction():
    slower, faster = (TimeRatio(r, 0.9 * r, 1.1 * r, 1e-9) for r in (1.5, 0.7))
    unsure = slower._replace(chance=0.5)
    first = {(KEY, name): slower for name in ("alike", "reversed", "unsure")}
    second = dict(zip(first, (slower._replace(ratio=1.4), faster, unsure), strict=True))
    confirmed = list(rerunning._confirmed(first, second).values())
    assert [ratio.chance for ratio in confirmed] == [1e-9, 1.0, 1.0]
    assert confirmed[0].ratio == 1.4


def test_ratios_within_a_hundredth_count_as_chance():
    pairs = {(KEY, str(r)): [(1.0, r)] * 30 for r in (0.985, 0.992, 1.0, 1.008, 1.015)}
    chances = [ratio.chance < 1e-6 for ratio in rerunning._ratios(pairs).values()]
    assert chances == [True, False, False, False, True]


def test_what_cannot_be_measured_is_said_and_nothing_is_left(repository):
    with pytest.raises(ValueError, match="something to measure in both revisions, got nothing"):
        side_by_side(repository, words=("no such solver",))
    (repository / "bench" / "experiments" / "__init__.py").write_text("raise OSError('broken')")
    with pytest.raises(ValueError, match="the working copy cannot be measured: OSError: broken"):
        side_by_side(repository)
    assert worktrees(repository) == 1


@pytest.mark.skipif(not Path("/proc").exists(), reason="reads the states of processes in /proc")
@pytest.mark.sample(str(int(signal.SIGKILL)))
@pytest.mark.parametrize(
    "number",
    [signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGHUP],
)
def test_a_signal_leaves_no_worktree_no_file_and_no_process(number, repository, temporary, start):
    """Ctrl-C goes to the terminal's whole group; what SIGKILL leaves, the next start removes."""
    measure_endlessly(repository)
    process = start()
    pids = temporary.with_name("pids")
    assert eventually(lambda: pids.exists() and len(pids.read_text().split()) == 2)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    started = {*pids.read_text().split(), *children}
    assert len(started) == 5  # two revisions, the guard of each, and what one has started
    assert all(map(is_running, started))
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    killed = number == signal.SIGKILL
    assert process.wait(timeout=60) == (-number if killed else 128 + number)
    assert eventually(lambda: not any(map(is_running, started)))
    assert worktrees(repository) == 1
    assert bool(list(temporary.iterdir())) is killed
    if killed:
        assert start("--only", "no such solver").wait(timeout=60) == 2
    assert list(temporary.iterdir()) == []


@pytest.mark.slow
def test_a_rerun_beside_another_one_leaves_its_files(repository, temporary, start):
    measure_endlessly(repository)
    start()
    assert eventually(temporary.with_name("pids").exists)
    [folder] = temporary.iterdir()
    assert start("--only", "no such solver").wait(timeout=60) == 2
    assert (folder / "old" / "bench").is_dir()


@pytest.mark.sample("archive")
@pytest.mark.parametrize("content", [bytes(20_000), os.urandom(20_000)], ids=["files", "archive"])
def test_a_full_disk_leaves_nothing(content, repository, temporary, start):
    """A limit on the size of files stands for a full disk; only zeros fit in as an archive."""
    (repository / "large").write_bytes(content)
    git(repository, "add", ".")
    git(repository, "commit", "-q", "-m", "large")
    git(repository, "tag", "-f", "before")
    shell = ("sh", "-c", f'ulimit -f 8; exec "{sys.executable}" -P -m plumbob "$@"', "sh")
    process = start(program=shell)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "--rerun: expected a revision that git can check out, got 'before'" in err
    assert err.count("\n") == 1
    assert worktrees(repository) == 1
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("revision", ["no-such-revision", "--force", "HEAD:bench"])
def test_what_is_no_revision_is_refused(revision, capsys, repository, monkeypatch):
    monkeypatch.chdir(repository)
    assert cli.run_command(["compare", f"--rerun={revision}"]) == 2
    out, err = capsys.readouterr()
    message = (
        f"plumbob: --rerun: expected a revision that git can check out, got {revision!r} fatal: "
    )
    assert out == ""
    assert err.startswith(message)
    assert err.count("\n") == 1


def test_another_project_is_refused_and_nothing_is_measured(capsys, tmp_path, monkeypatch):
    project = tmp_path / "project"
    project.mkdir()
    refusal = (
        "plumbob: --rerun: expected --with and a solver of yours, or to be run in a clone of "
        f"Plumbob, got {project}\n"
    )
    monkeypatch.chdir(project)
    for prepare in (
        lambda: None,
        lambda: git(project, "init", "-q"),
        lambda: (project / "pyproject.toml").write_text('[project]\nname = "mine"\n'),
        lambda: (project / "pyproject.toml").write_text("no TOML"),
    ):
        prepare()
        assert cli.run_command(["compare", "--rerun", "HEAD"]) == 2
        assert capsys.readouterr() == ("", refusal)


def test_the_command_measures_the_clone_in_which_it_is_run(capsys, repository, monkeypatch):
    """Also in a folder of it, and where it is not the clone that Plumbob is installed from."""
    monkeypatch.chdir(repository / "bench")
    write(repository, digit=0.75)
    arguments = ["--rerun", "before", "--fail", "accuracy", "--pairs", "2"]
    code = cli.run_command(["compare", *arguments])
    out, err = capsys.readouterr()
    assert code == 1
    assert out.splitlines()[0] == "STOP: 2 rows beyond the limits"
    assert "plumbob: pair 2 of 2" in err


ARM = """from .sweeps import SWEEPS

import numpy as np


class Arm:
    PLUMBOB = {"name": "My arm"}

    def inverse_kinematics(self, offsets, target, tolerance, max_iterations):
        x, d = np.cumsum(offsets, axis=0), np.linalg.norm(offsets, axis=1)
        for _ in range(SWEEPS):
            x[-1] = target
            for i in range(len(x) - 2, -1, -1):
                x[i] = x[i + 1] + d[i + 1] * (x[i] - x[i + 1]) / np.linalg.norm(x[i] - x[i + 1])
            x[0] = offsets[0]
            for i in range(1, len(x)):
                x[i] = x[i - 1] + d[i] * (x[i] - x[i - 1]) / np.linalg.norm(x[i] - x[i - 1])
        return {"positions": x}
"""


@pytest.mark.slow
def test_a_solver_of_another_project_is_measured_at_both_revisions(capsys, tmp_path, monkeypatch):
    """In a package below src, which is not installed, and whose settings stand in another file."""
    package = tmp_path / "src" / "armkit"
    package.mkdir(parents=True)
    for name, text in (("__init__", ""), ("sweeps", "SWEEPS = 40\n"), ("arm", ARM)):
        (package / f"{name}.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    gate = ["compare", "--rerun", "HEAD", "--only", "chain/near", "--pairs", "1"]
    assert cli.run_command([*gate, "--with", "armkit.arm:Arm"]) == 2
    assert "--rerun: expected to be run in a git repository" in capsys.readouterr().err
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "good")
    (package / "sweeps.py").write_text("SWEEPS = 2\n")
    assert cli.run_command([*gate, "--with", "armkit.arm:Arm"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "STOP: 1 row beyond the limits"
    found = r"  LESS RIGHT chain/near, My arm: share solved fell from \d+.\d % to \d+.\d % "
    assert re.match(found + r"\(limit 1 point\)$", lines[2])
    (package / "new.py").write_text(ARM)
    assert cli.run_command([*gate, "--with", "armkit.new:Arm"]) == 2
    assert "--rerun: HEAD cannot be measured: with: expected a solver" in capsys.readouterr().err


@pytest.mark.parametrize("own", [True, False])
def test_only_own_folders_of_runs_that_were_killed_are_removed(tmp_path, monkeypatch, own):
    """Everyone may write to the folder of temporary files."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = tmp_path / f"{PREFIX}killed"
    (folder / "old").mkdir(parents=True)
    (folder / "lock").touch()
    user = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: user if own else user + 1)
    with _temporary_folder():
        assert folder.exists() != own
