"""What is finished stays on record: whatever is asked for later, however a run ends."""

import errno
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from plumbob import bench
from plumbob.bench.experiments import Block, Measured
from plumbob.bench.harness import machine, run
from plumbob.bench.harness.folder_lock import locked
from plumbob.bench.harness.machine import stamp
from plumbob.bench.harness.record import RecordFile, decode, encode
from plumbob.bench.harness.values import Values
from plumbob.bench.tables.results import Results

ROOT = Path(bench.__file__).resolve().parents[1]


class Numbers(Values, frozen=True):
    x: list


@pytest.fixture
def solvers(monkeypatch):
    """Names of solvers, each of which has one block; a test may change them, and settings."""
    asked = {"a": {}, "b": {}}

    def blocks(suite, scale):
        for solver, settings in asked.items():
            yield Block(suite, "p", solver, lambda: Measured(Numbers([1.0])), settings, size=2)

    monkeypatch.setattr(run, "blocks", blocks)
    return asked


def go(folder):
    return list(run.run(["made up"], "quick", folder))


def stored(folder):
    return [r for r in RecordFile(folder).read().records if r.suite == "made up"]


def test_records_of_a_solver_that_is_not_asked_for_stay_and_are_counted(solvers, tmp_path, make):
    theirs = [make.record("made up", f"p{i}", "My solver", arrays={"x": [i]}) for i in range(20)]
    RecordFile(tmp_path).append(theirs)
    events = [event for event in go(tmp_path) if event.state == run.NOT_RUN]
    assert [event.message for event in events] == ["20 records of My solver kept, not run"]
    kept = [r for r in stored(tmp_path) if r.solver == "My solver"]
    assert [encode(r) for r in kept] == [encode(r) for r in theirs]
    assert len(Results(stored(tmp_path)).records) == 22


def test_records_under_settings_of_before_stay_on_record_but_leave_the_tables(solvers, tmp_path):
    solvers["a"] = {"version": "1"}
    go(tmp_path)
    solvers["a"] = {"version": "2"}
    messages = [event.message for event in go(tmp_path) if event.state == run.NOT_RUN]
    assert messages == ["1 record of a under other settings kept, left out of tables"]
    assert sorted(r.settings["version"] for r in stored(tmp_path) if r.solver == "a") == ["1", "2"]
    shown = [r for r in Results(stored(tmp_path)).records if r.solver == "a"]
    assert [r.settings["version"] for r in shown] == ["2"]
    solvers["a"] = {"version": "1"}
    go(tmp_path)
    shown = [r for r in Results(stored(tmp_path)).records if r.solver == "a"]
    assert [r.settings["version"] for r in shown] == ["1"]


def test_what_says_only_that_something_was_missing_leaves_when_it_is_there(solvers, tmp_path, make):
    RecordFile(tmp_path).append([make.record("made up", "all", "a", notes={"remark": "missing"})])
    go(tmp_path)
    assert {r.problem for r in Results(stored(tmp_path)).records} == {"p"}


OTHER = {
    "sources": ({"source": "old"}, {}, "other sources (old, now {source})"),
    "versions": (
        {"versions": {**stamp()["versions"], "numpy": "1.0"}}, {},
        "other versions (numpy 1.0, now {numpy})"),
    "machine": (
        {"machine": {**stamp()["machine"], "processor": "abacus"}}, {},
        "another machine (processor abacus, now {processor})"),
    "size": ({}, {"size": 1}, "a larger size (1, now 2)"),
    "failure": ({}, {"notes": {"failed": "no"}}, "it failed before"),
}  # fmt: skip


@pytest.mark.parametrize(("other", "more", "reason"), OTHER.values(), ids=OTHER)
def test_why_something_is_measured_again_is_said(solvers, tmp_path, make, other, more, reason):
    fields = {"size": 2, "stamp": {**stamp(), **other}} | more
    RecordFile(tmp_path).append([make.record("made up", "p", "a", **fields)])
    said = [event.message for event in go(tmp_path) if event.state == run.MEASURING]
    values = {"source": stamp()["source"], **stamp()["versions"], **stamp()["machine"]}
    assert said == [reason.format(**values), ""]


def test_affinity_and_load_are_notes_and_no_identity(solvers, tmp_path, monkeypatch):
    if not hasattr(os, "sched_getaffinity"):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    go(tmp_path)
    machine.stamp.cache_clear()
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    monkeypatch.setattr(psutil, "getloadavg", lambda: (99.0, 9.0, 9.0))
    states = [event.state for event in go(tmp_path)]
    assert states == [run.KEPT, run.KEPT]
    assert machine.conditions()["affinity"] == 1
    assert machine.conditions()["load"] == 99.0
    assert {"affinity", "load", "pace"} <= set(stored(tmp_path)[0].conditions)


def test_the_commit_of_the_sources_is_on_record_and_whether_they_were_changed(tmp_path):
    def git(*arguments):
        identity = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
        done = subprocess.run(
            ["git", "-C", str(tmp_path), *identity, *arguments],
            check=True, capture_output=True, text=True,
        )  # fmt: skip
        return done.stdout.strip()

    assert machine.commit_of(tmp_path) == ""
    git("init", "-q")
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "a.py").write_text("1")
    git("add", "bench")
    git("commit", "-q", "-m", "a")
    head = git("rev-parse", "HEAD")
    assert machine.commit_of(tmp_path) == head
    assert machine.commit_of(tmp_path / "bench") == ""  # within somebody else's repository
    (tmp_path / "bench" / "a.py").write_text("2")
    assert machine.commit_of(tmp_path) == f"{head} with changes"


@pytest.mark.parametrize("other", [2, 4])
def test_a_record_of_another_format_is_refused_by_its_number(make, other):
    content = json.loads(encode(make.record("made up", "p", "a")))
    with pytest.raises(ValueError, match=rf"Invalid enum value {other} - at `\$.format`"):
        decode(json.dumps({**content, "format": other}))


@pytest.mark.parametrize("content", ["what the user wrote", None])
def test_a_link_in_place_of_the_lock_leads_to_no_file(tmp_path, content):
    """A folder from elsewhere may hold one; a lock file is emptied for the number of a process."""
    file = tmp_path / "file"
    if content is not None:
        file.write_text(content)
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "records.lock").symlink_to(file)
    with (
        pytest.raises(ValueError, match=f"{folder}/records.lock: expected a file, got a link"),
        locked(folder),
    ):
        pass
    assert (file.read_text() if file.exists() else None) == content


def test_two_runs_into_one_folder_exclude_each_other(solvers, tmp_path):
    with locked(tmp_path), pytest.raises(ValueError, match=rf"{tmp_path}: .*process {os.getpid()}"):
        go(tmp_path)
    assert not RecordFile(tmp_path).path.exists()
    go(tmp_path)
    assert len(stored(tmp_path)) == 2


def test_a_lock_is_free_once_its_process_was_killed(tmp_path):
    script = (
        "import sys, time; from plumbob.bench.harness.folder_lock import locked\n"
        "with locked(sys.argv[1]): print('locked', flush=True); time.sleep(60)"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path)], cwd=ROOT, stdout=subprocess.PIPE
    )
    with child:
        child.stdout.readline()
        with pytest.raises(ValueError, match=f"process {child.pid}"), locked(tmp_path):
            pass
        child.kill()
    with locked(tmp_path):
        pass


def test_a_full_disk_costs_one_sentence_and_nothing_on_record(tmp_path, monkeypatch, make):
    file = RecordFile(tmp_path)
    file.append([make.record("made up", "p", "a")])
    whole = file.path.read_bytes()

    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space left on device; what was finished") as caught:
            file.append([make.record("made up", "p", "b")])
        assert caught.value.filename == str(file.path)
        with pytest.raises(OSError, match="No space left"):
            file.drop(lambda record: True)
    assert file.path.read_bytes() == whole
    assert list(tmp_path.iterdir()) == [file.path]


def test_a_write_that_ends_in_its_middle_leaves_no_part_of_it(tmp_path, make):
    """The limit on the size of files lets a part be written, as a disk does that fills up."""
    file = RecordFile(tmp_path)
    file.append([make.record("made up", "p", "a")])
    whole = file.path.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) + 100, hard))
    try:
        with pytest.raises(OSError, match="File too large; what was finished"):
            file.append([make.record("made up", "p", "b")])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert file.path.read_bytes() == whole
    file.append([make.record("made up", "p", "b")])
    assert file.path.read_bytes().startswith(whole)


COUNT = 40
# A suite whose numbers depend on nothing, and whose records are long, so that kills hit a write.
RUN = f"""
import sys, time
import numpy as np
from plumbob.bench.experiments import Block, Measured
from plumbob.bench.harness import run
from plumbob.bench.harness.values import Values

class Numbers(Values, frozen=True):
    x: list

def measure(i):
    time.sleep(0.002)
    return Measured(Numbers(np.random.default_rng(i).random(20_000)))

def blocks(suite, scale):
    for i in range({COUNT}):
        yield Block(suite, f"p{{i}}", "a", lambda i=i: measure(i))

run.blocks = blocks
print("begun", flush=True)
for event in run.run(["made up"], "quick", sys.argv[1]):
    if event.state == run.MEASURED:
        print(event.what, flush=True)
"""


def begin(folder):
    """A run in a process of its own, begun."""
    child = subprocess.Popen(
        [sys.executable, "-c", RUN, str(folder)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "begun\n"
    return child


def whole_lines(folder):
    path = RecordFile(folder).path
    content = path.read_bytes() if path.exists() else b""
    return content[: content.rfind(b"\n") + 1].splitlines()


def but_for_times(record):
    return (*record.key, record.size, record.stamp, record.notes, record.arrays["x"].tobytes())


@pytest.mark.parametrize(
    "kills", [5, pytest.param(50, marks=pytest.mark.slow)], ids=lambda kills: f"{kills} kills"
)
def test_kills_at_random_moments_lose_nothing_finished_and_repeat_nothing(tmp_path, kills):
    chance, measured, folder, undisturbed = random.Random(12), [], tmp_path / "a", tmp_path / "b"
    struck = 0
    while struck < kills:
        if len(whole_lines(folder)) > COUNT:  # the run was through: begin another
            folder, measured = tmp_path / f"again {struck}", []
        before = whole_lines(folder)
        with begin(folder) as child:
            time.sleep(chance.uniform(0.0, 0.15))
            child.send_signal(signal.SIGKILL)
            measured += child.stdout.read().splitlines()
        struck += 1
        assert whole_lines(folder)[: len(before)] == before
    with begin(folder) as child:
        measured += child.stdout.read().splitlines()
    with begin(undisturbed) as child:
        child.wait()
    lines = [decode(line) for line in whole_lines(folder)]
    assert len({record.key for record in lines}) == len(lines) == COUNT + 1
    assert len(set(measured)) == len(measured)
    ours, theirs = ([but_for_times(r) for r in stored(place)] for place in (folder, undisturbed))
    assert ours == theirs
    assert len(ours) == COUNT
    assert RecordFile(folder).read().warning == ""
