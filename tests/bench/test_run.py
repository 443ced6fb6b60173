"""Running suites: each block is stored at once, stays on record, and is measured only once."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import psutil
import pytest

from plumbob import bench
from plumbob.bench.experiments import Block
from plumbob.bench.measure import machine, run
from plumbob.bench.measure.folder_lock import locked
from plumbob.bench.measure.machine import stamp
from plumbob.bench.measure.record import RecordFile, encode
from plumbob.bench.tables.results import Results

ROOT = Path(bench.__file__).resolve().parents[1]


class Suite:
    """Blocks of three solvers that count how often they are measured; one may be made to fail."""

    def __init__(self, monkeypatch, size=2):
        self.measured, self.size, self.trouble = [], size, {}
        self.settings = {"a": {}, "b": {}, "c": {}}
        monkeypatch.setattr(run, "blocks", self.blocks)

    def blocks(self, suite, scale):
        for solver, settings in self.settings.items():
            measure = lambda s=solver: self.measure(s)  # noqa: E731
            yield Block(suite, "p", solver, measure, settings, size=self.size)

    def measure(self, solver):
        if solver in self.trouble:
            raise self.trouble[solver]
        self.measured.append(solver)
        return {"x": np.ones(1)}


@pytest.fixture
def suite(monkeypatch):
    return Suite(monkeypatch)


def events(folder):
    return list(run.run(["made up"], "quick", folder))


def states(folder):
    return [event.state for event in events(folder) if event.state != run.MEASURING]


def messages(folder, state):
    return [event.message for event in events(folder) if event.state == state]


def stored(folder, solver=None):
    """The records of the suite, or of one of its solvers."""
    records = [r for r in RecordFile(folder).read().records if r.suite == "made up"]
    return [record for record in records if solver in (None, record.solver)]


def test_a_second_run_measures_nothing(suite, tmp_path):
    assert states(tmp_path) == [run.MEASURED] * 3
    assert states(tmp_path) == [run.KEPT] * 3
    assert suite.measured == ["a", "b", "c"]


def inside_compiled_code():
    """Return what Ctrl-C becomes where it strikes in a compiled kernel."""
    error = SystemError("returned a result with an exception set")
    error.__cause__ = KeyboardInterrupt()
    return error


@pytest.mark.parametrize(
    ("error", "truncated"),
    [(KeyboardInterrupt(), 0), (inside_compiled_code(), 0), (KeyboardInterrupt(), 9)],
)
def test_an_interrupted_run_continues_and_repeats_only_a_truncated_block(
    suite, tmp_path, error, truncated
):
    suite.trouble = {"c": error}
    with pytest.raises(KeyboardInterrupt):
        events(tmp_path)
    assert [record.solver for record in stored(tmp_path)] == ["a", "b"]
    assert not any(r.suite == "finished" for r in RecordFile(tmp_path).read().records)
    path = RecordFile(tmp_path).path
    path.write_bytes(path.read_bytes()[: -truncated or None])
    suite.trouble = {}
    events(tmp_path)
    assert suite.measured == ["a", "b", *(["b"] if truncated else []), "c"]
    assert RecordFile(tmp_path).read().warning == ""


def test_a_block_that_fails_costs_no_other_and_is_tried_again(suite, tmp_path):
    suite.trouble = {"b": OSError("no engine")}
    assert messages(tmp_path, run.FAILED) == ["OSError: no engine"]
    assert suite.measured == ["a", "c"]
    suite.trouble = {}
    assert states(tmp_path) == [run.KEPT, run.KEPT, run.MEASURED]


@pytest.mark.parametrize(("before", "after", "again"), [(200, 2000, True), (2000, 200, False)])
def test_a_larger_block_replaces_a_smaller_one_but_not_the_reverse(
    monkeypatch, tmp_path, before, after, again
):
    Suite(monkeypatch, size=before)
    events(tmp_path)
    second = Suite(monkeypatch, size=after)
    events(tmp_path)
    assert bool(second.measured) is again


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
    "files": ({}, {"facts": {"digest": "old"}}, "other sources of a (old, now none)"),
    "problem": ({}, {"facts": {"problem_digest": "old"}}, "p is another problem now"),
    "settings": ({}, {"facts": {"superseded": "then"}}, "its settings are asked for again"),
}  # fmt: skip


@pytest.mark.parametrize(("other", "more", "reason"), OTHER.values(), ids=OTHER)
def test_the_reason_of_a_new_measurement_is_reported(suite, tmp_path, make, other, more, reason):
    fields = {"size": 2, "stamp": {**stamp(), **other}} | more
    RecordFile(tmp_path).append([make.record("made up", "p", "a", **fields)])
    names = {"source": stamp()["source"], **stamp()["versions"], **stamp()["machine"]}
    assert messages(tmp_path, run.MEASURING) == [reason.format(**names), "", ""]


def test_records_that_are_not_requested_stay_and_are_counted(suite, tmp_path, make):
    old = {"stamp": {**stamp(), "source": "old"}}
    extra = [make.record("made up", f"p{i}", "My solver", arrays={"x": [i]}) for i in range(20)]
    other_suite = make.record("another", "p", "a", **old)
    RecordFile(tmp_path).append([*extra, other_suite])
    assert messages(tmp_path, run.NOT_RUN) == ["20 records of My solver kept, not run"]
    assert [encode(r) for r in stored(tmp_path, "My solver")] == [encode(r) for r in extra]
    assert len(Results(stored(tmp_path)).records) == 23
    suites = [record.suite for record in RecordFile(tmp_path).read().records]
    assert suites.count("another") == suites.count("finished") == 1


def test_records_with_old_settings_stay_but_leave_the_tables(suite, tmp_path):
    suite.settings["a"] = {"version": "1"}
    assert messages(tmp_path, run.NOT_RUN) == []
    suite.settings["a"] = {"version": "2"}
    (message,) = messages(tmp_path, run.NOT_RUN)
    assert message == "1 record of a under other settings kept, left out of tables"
    assert sorted(r.settings["version"] for r in stored(tmp_path, "a")) == ["1", "2"]
    for version in ("2", "1"):
        suite.settings["a"] = {"version": version}
        events(tmp_path)
        shown = [r for r in Results(stored(tmp_path)).records if r.solver == "a"]
        assert [r.settings["version"] for r in shown] == [version]


def test_a_remark_that_something_is_missing_leaves_when_it_is_there(suite, tmp_path, make):
    RecordFile(tmp_path).append([make.record("made up", "all", "a", notes={"remark": "missing"})])
    events(tmp_path)
    assert {r.problem for r in Results(stored(tmp_path)).records} == {"p"}


def test_forget_leaves_other_suites_and_solvers(suite, tmp_path, make):
    events(tmp_path)
    extra = make.record("made up", "p", "My solver", arrays={"x": [1.0]})
    others = [make.record("another", "p", "a"), make.record("finished", "another", ""), extra]
    RecordFile(tmp_path).append(others)
    run.forget(["made up"], "quick", tmp_path)
    left = {(r.suite, r.solver) for r in RecordFile(tmp_path).read().records}
    assert left == {("another", "a"), ("finished", ""), ("made up", "My solver")}


def test_affinity_and_load_are_conditions_that_repeat_nothing(suite, tmp_path, monkeypatch):
    if not hasattr(os, "sched_getaffinity"):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    events(tmp_path)
    machine.stamp.cache_clear()
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    monkeypatch.setattr(psutil, "getloadavg", lambda: (99.0, 9.0, 9.0))
    assert states(tmp_path) == [run.KEPT] * 3
    conditions = machine.conditions()
    assert (conditions["affinity"], conditions["load"]) == (1, 99.0)
    assert {"affinity", "load", "pace"} <= set(stored(tmp_path)[0].conditions)


def test_the_commit_of_the_sources_says_whether_they_were_changed(tmp_path):
    def git(*arguments):
        identity = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
        command = ["git", "-C", str(tmp_path), *identity, *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

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


@pytest.mark.parametrize("content", ["what the user wrote", None])
def test_a_link_in_place_of_the_lock_leads_to_no_file(tmp_path, content):
    """A folder from elsewhere may hold one; a lock file is emptied for the number of a process."""
    file, folder = tmp_path / "file", tmp_path / "folder"
    if content is not None:
        file.write_text(content)
    folder.mkdir()
    (folder / "records.lock").symlink_to(file)
    message = f"{folder}/records.lock: expected a file, got a link"
    with pytest.raises(ValueError, match=message), locked(folder):
        pass
    assert (file.read_text() if file.exists() else None) == content


def test_two_runs_into_one_folder_exclude_each_other(suite, tmp_path):
    with locked(tmp_path), pytest.raises(ValueError, match=rf"{tmp_path}: .*process {os.getpid()}"):
        events(tmp_path)
    assert not RecordFile(tmp_path).path.exists()
    events(tmp_path)
    assert len(stored(tmp_path)) == 3


def test_a_lock_is_free_once_its_process_was_killed(tmp_path):
    script = (
        "import sys, time; from plumbob.bench.measure.folder_lock import locked\n"
        "with locked(sys.argv[1]): print('locked', flush=True); time.sleep(60)"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as child:
        child.stdout.readline()
        with pytest.raises(ValueError, match=f"process {child.pid}"), locked(tmp_path):
            pass
        child.kill()
    with locked(tmp_path):
        pass
