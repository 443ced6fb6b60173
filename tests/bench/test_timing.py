"""Timing, for real but in a blink: pytest-benchmark, in a process of its own."""

import numpy as np
import pytest

from bench.experiments import Scale
from bench.experiments.timing import case as timing_case
from bench.experiments.timing import job, kinematics, measurement
from bench.experiments.timing.case import (
    COMPILED,
    LIMIT,
    Case,
    Work,
    copying,
    stream,
    streaming,
)
from bench.experiments.timing.cases import cases
from bench.experiments.timing.job import ROUNDS, TimingJob
from bench.harness import run
from bench.harness.machine import stamp
from bench.harness.record import RecordFile
from bench.harness.worker import Unfit
from reference import forward_kinematics, set_num_threads

WORK = Work("p", "s", "g", "t")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of the records of a run that times a few cases for a millisecond."""
    folder, few = tmp_path_factory.mktemp("timed"), pytest.MonkeyPatch()
    few.setitem(run.SCALES, "quick", Scale(1, 0.001))
    few.setattr(measurement, "cases", lambda: [c for c in cases() if is_wanted(c)])
    try:
        events = list(run.run(["timing"], "quick", folder))
    finally:
        few.undo()
    assert {event.state for event in events} == {run.MEASURING, run.MEASURED}
    return folder


def is_wanted(case):
    return case.solver == COMPILED and case.work.group == "10 balls"


def test_every_case_is_kept_with_rounds_of_one_operation_each(folder):
    records = [r for r in RecordFile(folder).read().records if r.suite == "timing"]
    assert {record.settings["operations"] for record in records} == {1, 10_000, 50_000}
    for record in records:
        assert not record.failed
        assert 5 <= record.arrays["seconds"].size <= 10 * ROUNDS
        assert (record.arrays["seconds"] > 0).all()
        assert record.size == 0.001
        together = record.arrays["seconds"].sum() * record.settings["operations"]
        assert together < record.seconds
        assert record.stamp["machine"] == stamp()["machine"]
        assert record.facts["subject"] == "kinematics"


def test_a_suite_of_the_timing_is_finished_as_any_other(folder):
    finished = [r.problem for r in RecordFile(folder).read().records if r.suite == "finished"]
    assert finished == ["timing"]


def fails():
    raise OSError("no engine")


@pytest.mark.parametrize(
    ("prepare", "options", "why"),
    [(fails, (), "OSError: no engine"), (int, ("--no-such-option",), "no-such-option")],
)
def test_a_case_that_fails_says_why(monkeypatch, prepare, options, why):
    """Neither what a case raises nor what pytest complains of is lost."""
    case = Case(WORK, "me", prepare)
    given = job.arguments
    monkeypatch.setattr(job, "cases", lambda: (case,))
    monkeypatch.setattr(job, "arguments", lambda *args: [*given(*args), *options])
    (message,) = TimingJob(case.key, 0.001).perform()
    assert isinstance(message, Unfit)
    assert why in message.why


def test_the_limit_moves_as_many_bytes_as_it_says(monkeypatch):
    moved = []
    monkeypatch.setattr(
        np, "copyto", lambda sink, source: moved.append(sink.nbytes + source.nbytes)
    )
    case = copying(WORK, 1600, passes=3, operations=10)
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
    case = streaming(WORK, 320, 560, cores=many, least=0 if many == 1 else 8)
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
        limits = [case for case in kinematics.cases() if case.solver == LIMIT]
        calls = name, f"{batch:,} poses a call"
        (limit,) = [case for case in limits if (case.work.group, case.work.title) == calls]
        assert limit.moved == given.nbytes + 2 * written


def test_every_forward_kinematics_stands_beside_its_limit_on_as_many_cores():
    cases = list(kinematics.cases())
    limits = {case.work.problem: case for case in cases if case.solver == LIMIT}
    for case in cases:
        assert limits[case.work.problem].cores == case.cores
        assert limits[case.work.problem].operations == case.operations
    assert {case.cores for case in cases} == {1, None}
