"""Running suites: each block is stored at once, and what is stored is not measured again."""

import pytest

from plumbob.bench.experiments import Block, Measured
from plumbob.bench.harness import run
from plumbob.bench.harness.machine import stamp
from plumbob.bench.harness.record import RecordFile


class Suite:
    """Three blocks that count how often they are measured; one may be made to fail."""

    def __init__(self, monkeypatch, size=0):
        self.measured, self.size, self.trouble = [], size, {}
        monkeypatch.setattr(run, "blocks", self.blocks)

    def blocks(self, suite, scale):
        for solver in ("a", "b", "c"):
            yield Block(suite, "p", solver, lambda s=solver: self.measure(s), size=self.size)

    def measure(self, solver):
        if solver in self.trouble:
            raise self.trouble[solver]
        self.measured.append(solver)
        return Measured({"x": [1.0]})


@pytest.fixture
def suite(monkeypatch):
    return Suite(monkeypatch)


def go(folder):
    return [
        event for event in run.run(["made up"], "quick", folder) if event.state != run.MEASURING
    ]


def stored(folder):
    return [r.solver for r in RecordFile(folder).read().records if r.suite == "made up"]


def test_a_second_run_measures_nothing(suite, tmp_path):
    assert [event.state for event in go(tmp_path)] == [run.MEASURED] * 3
    assert [event.state for event in go(tmp_path)] == [run.KEPT] * 3
    assert suite.measured == ["a", "b", "c"]


def inside_compiled_code():
    """Return what Ctrl-C becomes where it strikes in a compiled kernel."""
    error = SystemError("returned a result with an exception set")
    error.__cause__ = KeyboardInterrupt()
    return error


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), inside_compiled_code()])
def test_a_run_that_was_interrupted_is_taken_up_where_it_stopped(suite, tmp_path, stop):
    suite.trouble = {"c": stop}
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path)
    assert stored(tmp_path) == ["a", "b"]
    suite.trouble = {}
    go(tmp_path)
    assert suite.measured == ["a", "b", "c"]


def test_a_line_cut_off_by_a_kill_costs_its_own_block_only(suite, tmp_path):
    suite.trouble = {"c": KeyboardInterrupt()}
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path)
    path = RecordFile(tmp_path).path
    path.write_bytes(path.read_bytes()[:-9])
    suite.trouble = {}
    go(tmp_path)
    assert suite.measured == ["a", "b", "b", "c"]
    assert RecordFile(tmp_path).read().warning == ""


def test_a_block_that_fails_costs_no_other_and_is_tried_again(suite, tmp_path):
    suite.trouble = {"b": OSError("no engine")}
    events = go(tmp_path)
    assert [event.state for event in events] == [run.MEASURED, run.FAILED, run.MEASURED]
    assert events[1].message == "OSError: no engine"
    suite.trouble = {}
    assert [event.state for event in go(tmp_path)] == [run.KEPT, run.KEPT, run.MEASURED]


def test_other_sources_are_measured_again_and_what_nothing_asks_for_stays(suite, tmp_path, make):
    old = make.record("made up", "p", "a", stamp={**stamp(), "source": "old"})
    gone = make.record("made up", "renamed since", "a", stamp={**stamp(), "source": "old"})
    elsewhere = make.record("ik", "p", "a", stamp={**stamp(), "source": "old"})
    RecordFile(tmp_path).append([old, gone, elsewhere])
    go(tmp_path)
    assert suite.measured == ["a", "b", "c"]
    kept = {(r.suite, r.problem) for r in RecordFile(tmp_path).read().records}
    assert kept == {
        ("made up", "p"),
        ("made up", "renamed since"),
        ("ik", "p"),
        ("finished", "made up"),
    }


@pytest.mark.parametrize(("before", "after", "again"), [(200, 2000, True), (2000, 200, False)])
def test_a_larger_block_stands_for_a_smaller_one_but_not_the_reverse(
    monkeypatch, tmp_path, before, after, again
):
    Suite(monkeypatch, size=before)
    go(tmp_path)
    second = Suite(monkeypatch, size=after)
    go(tmp_path)
    assert bool(second.measured) is again


def test_forget_leaves_other_suites_and_what_nothing_asks_for(suite, tmp_path, make):
    go(tmp_path)
    theirs = make.record("made up", "p", "My solver", arrays={"x": [1.0]})
    others = [make.record("ik", "p", "a"), make.record("finished", "ik", ""), theirs]
    RecordFile(tmp_path).append(others)
    run.forget(["made up"], "quick", tmp_path)
    left = {(r.suite, r.solver) for r in RecordFile(tmp_path).read().records}
    assert left == {("ik", "a"), ("finished", ""), ("made up", "My solver")}


def test_a_suite_is_finished_only_when_it_went_through(suite, tmp_path):
    suite.trouble = {"c": KeyboardInterrupt()}
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path)
    assert not any(r.suite == "finished" for r in RecordFile(tmp_path).read().records)
