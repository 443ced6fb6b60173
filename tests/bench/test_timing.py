"""Timing, for real but in a blink: pytest-benchmark, in a process of its own."""

import itertools
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from plumbob.bench.experiments import Scale
from plumbob.bench.experiments.cloth.problem import cloth_swing
from plumbob.bench.experiments.timing import case as timing_case
from plumbob.bench.experiments.timing import cloth, job, kinematics, measurement
from plumbob.bench.experiments.timing.case import (
    COMPILED,
    LIMIT,
    Case,
    Work,
    copying,
    stream,
    streaming,
)
from plumbob.bench.experiments.timing.cases import cases
from plumbob.bench.experiments.timing.job import ROUNDS, SWEEPS, Timed, TimingJob
from plumbob.bench.harness import run
from plumbob.bench.harness.machine import stamp
from plumbob.bench.harness.record import RecordFile
from plumbob.bench.harness.worker import Done, Found, Unfit
from plumbob.crosscheck.engines import MujocoMassSpring
from plumbob.reference import forward_kinematics, set_num_threads

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
        assert len(record.arrays["seconds"]) == SWEEPS
        assert SWEEPS <= record.arrays["seconds"].size <= 10 * ROUNDS
        assert (record.arrays["seconds"] > 0).all()
        assert record.size == 0.001
        assert record.facts["noise"] > 0
        assert record.stamp["machine"] == stamp()["machine"]
        assert record.facts["subject"] == "kinematics"
    assert len({record.facts["together"] for record in records}) == 1


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
    (message,) = TimingJob((case.key,), 0.001).perform()
    assert isinstance(message, Unfit)
    assert why in message.why


@pytest.fixture
def said(monkeypatch):
    """What a job says of three cases, one of which fails, and which was called when."""
    called = []

    def preparing(name):
        return lambda: lambda: called.append(name)

    made = [Case(WORK, name, preparing(name)) for name in "ab"] + [Case(WORK, "c", fails)]
    monkeypatch.setattr(job, "cases", lambda: made)
    messages = list(TimingJob(tuple(case.key for case in made), 0.001).perform())
    return messages, called


def test_cases_that_are_compared_alternate_in_an_order_by_lot(said):
    (found, done), called = said
    assert isinstance(found, Found)
    assert isinstance(done, Done)
    changes = sum(a != b for a, b in itertools.pairwise(called))
    assert changes >= SWEEPS - 1
    assert [np.shape(rounds)[0] for rounds in found.values["rounds"][:2]] == [SWEEPS] * 2
    assert all(np.ndim(rounds) == 2 for rounds in found.values["rounds"][:2])


def test_a_case_that_fails_costs_none_that_it_is_compared_with(said):
    (found, _), _ = said
    assert found.values["rounds"][2] == []
    assert found.values["troubles"] == ["", "", "OSError: no engine"]


def test_every_sweep_has_every_case_once_and_the_order_is_seeded():
    case = [Case(WORK, name, int) for name in "abcde"]
    order = np.reshape(Timed(case).order, (SWEEPS, 5))
    assert (np.sort(order, axis=1) == np.arange(5)).all()
    assert len(np.unique(order, axis=0)) > SWEEPS / 2
    assert Timed(case).order == order.ravel().tolist()


def test_a_group_is_timed_once_and_what_is_left_of_another_run_is_not_used(monkeypatch):
    made = [Case(WORK, name, int) for name in "ab"]
    asked = []

    def find(job):
        asked.append(job)
        return {"rounds": [[[1.0 + len(asked)]], []], "paces": [1.0], "troubles": ["", "broken"]}

    monkeypatch.setattr(measurement, "cases", lambda: made)
    monkeypatch.setattr(measurement, "worker_process", lambda: SimpleNamespace(find=find))
    blocks = list(measurement.blocks(Scale(1, 0.1)))
    assert blocks[0].measure().arrays["seconds"].tolist() == [[2.0]]
    with pytest.raises(RuntimeError, match="broken"):
        blocks[1].measure()
    assert len(asked) == 1
    assert blocks[0].measure().arrays["seconds"].tolist() == [[3.0]]  # measured, not remembered
    again = list(measurement.blocks(Scale(1, 0.1)))
    with pytest.raises(RuntimeError, match="broken"):
        again[1].measure()
    assert len(asked) == 3
    assert again[0].measure().arrays["seconds"].tolist() == [[4.0]]
    with pytest.raises(RuntimeError, match="broken"):
        again[1].measure()
    monkeypatch.setattr(measurement, "FRESH", -1.0)  # as if found long ago
    with pytest.raises(RuntimeError, match="broken"):
        again[1].measure()
    assert again[0].measure().arrays["seconds"].tolist() == [[7.0]]
    assert len(asked) == 6


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


@pytest.mark.parametrize(("integrator", "count"), [("Euler", 10), ("discrete", 1)])
def test_mujoco_is_timed_from_its_own_state_without_conversions_and_energies(
    monkeypatch, integrator, count
):
    """They were 15 to 25 % of its time."""
    problem = cloth_swing(1, size=5)
    start = cloth.moving(problem)
    engine = MujocoMassSpring(problem.system, h=problem.h / count, integrator=integrator)
    expected = engine.step(start, steps=count).positions
    call = cloth.mujoco_steps(problem, integrator, count)
    for name in ("write", "read"):
        monkeypatch.setattr(MujocoMassSpring, name, None)
    call()
    engine = call()  # from the saved state again
    monkeypatch.undo()
    np.testing.assert_array_equal(engine.read().positions, expected)
    assert np.abs(expected - start.positions).max() > 1e-4
    assert not engine.model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_ENERGY
