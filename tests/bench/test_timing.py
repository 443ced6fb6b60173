"""Timing, for real but in a blink: pytest-benchmark, in a process of its own."""

import numpy as np
import pytest

from bench.experiments.timing import case as timing_case
from bench.experiments.timing import kinematics
from bench.experiments.timing.case import LIMIT, copying, stream, streaming
from bench.harness import run
from bench.harness.machine import stamp
from bench.harness.record import RecordFile
from reference import forward_kinematics, set_num_threads


@pytest.fixture(scope="module")
def timed(tmp_path_factory):
    """The folder of records and the events of timing a few cases for a millisecond."""
    folder = tmp_path_factory.mktemp("timed")
    arguments = run.timing_arguments(folder, 0.001, str(folder / "storage"))
    return folder, list(run._relay([*arguments, "-k", "kinematics and 10 and compiled"]))


def test_every_case_is_kept_with_rounds_of_one_operation_each(timed):
    folder, _ = timed
    records = RecordFile(folder).read().records
    assert {record.settings["operations"] for record in records} >= {1, 10_000}
    for record in records:
        assert not record.failed
        assert record.arrays["seconds"].size >= 5
        assert (record.arrays["seconds"] > 0).all()
        assert record.size == 0.001
        together = record.arrays["seconds"].sum() * record.settings["operations"]
        assert together == pytest.approx(record.seconds)
        assert record.stamp["machine"] == stamp()["machine"]


def test_what_happens_is_told_case_by_case(timed):
    folder, events = timed
    assert {event.state for event in events} == {run.MEASURING, run.MEASURED}
    measured = [event.what for event in events if event.state == run.MEASURED]
    assert measured == [f"{r.problem}, {r.solver}" for r in RecordFile(folder).read().records]


def test_pytest_that_fails_is_an_event_with_its_reason():
    (event,) = run._relay(["--no-such-option"])
    assert event.state == run.FAILED
    assert "no-such-option" in event.message


def test_the_limit_moves_as_many_bytes_as_it_says(monkeypatch):
    moved = []
    monkeypatch.setattr(
        np, "copyto", lambda sink, source: moved.append(sink.nbytes + source.nbytes)
    )
    case = copying("p", 1600, passes=3, operations=10)
    case.prepare()()
    assert moved == [1600] * 3
    assert case.moved == 4800
    assert case.solver == LIMIT


@pytest.mark.parametrize("many", [1, 3])
def test_the_limit_of_batches_reads_and_writes_all_that_it_says(many, monkeypatch):
    moved = []

    def watched(source, sink):
        stream(source, sink)
        moved.append((source.nbytes, sink.nbytes))
        assert (sink[: len(source)] == 2.0).all()
        assert (sink[len(source) :] == 1.0).all()

    monkeypatch.setattr(timing_case, "_stream", watched)
    case = streaming("p", 320, 560, cores=many, least=0 if many == 1 else 8)
    with set_num_threads(many):
        case.prepare()()
    assert len(moved) == (1 if many == 1 else 3 * 4)
    assert [sum(column) for column in zip(*moved, strict=True)] == [320, 560]
    assert case.moved == 320 + 2 * 560
    assert (case.solver, case.cores) == (LIMIT, many)


def test_a_batch_moves_what_its_limit_moves():
    for name, (skeleton, batch) in kinematics.models().items():
        given = np.zeros((batch, skeleton.joint_count, 4))
        given[..., 0] = 1.0
        pose = forward_kinematics(skeleton, given)
        written = pose.positions.nbytes + pose.rotations.nbytes
        (limit,) = [
            case
            for case in kinematics.cases()
            if case.solver == LIMIT and case.problem == f"kinematics/{name}/{batch:,} poses a call"
        ]
        assert limit.moved == given.nbytes + 2 * written


def test_every_forward_kinematics_stands_beside_its_limit_on_as_many_cores():
    cases = list(kinematics.cases())
    limits = {case.problem: case for case in cases if case.solver == LIMIT}
    for case in cases:
        assert limits[case.problem].cores == case.cores
        assert limits[case.problem].operations == case.operations
    assert {case.cores for case in cases} == {1, None}
