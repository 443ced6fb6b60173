"""Timing, for real but in a blink, in a process of its own."""

import inspect
import itertools
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from plumbob.bench import clock
from plumbob.bench.experiments import Scale
from plumbob.bench.experiments import timing as measurement
from plumbob.bench.experiments.parts import timing_cases
from plumbob.bench.experiments.parts.timing_cases import copying, stream, streaming
from plumbob.bench.experiments.timing import (
    COMPILED,
    LIMIT,
    PREPARED,
    ROUNDS,
    SWEEPS,
    TIGHT,
    TimedCase,
    TimedWork,
    cases,
)
from plumbob.bench.measure import run
from plumbob.bench.measure.machine import stamp
from plumbob.bench.measure.record import RecordFile
from plumbob.bench.peers import catalogue
from plumbob.bench.problems.cloth_swing import cloth_swing
from plumbob.bench.problems.robots import is_installed, robot
from plumbob.crosscheck.engines import SKELETON_ENGINES, MujocoMassSpring
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import ImplicitEuler, forward_kinematics, set_num_threads
from plumbob.reference.formats import mjcf, urdf

WORK = TimedWork("p", "s", "g", "t")


def in_this_process(patience, function, *arguments):
    """The result of a function without a process of its own: `test_isolation` has those."""
    return function(*arguments)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of the records of a run that times a few cases for a millisecond."""
    folder, few = tmp_path_factory.mktemp("timed"), pytest.MonkeyPatch()
    few.setitem(run.SCALES, "quick", Scale(1, 0.001))
    some = [c for c in cases() if (c.solver, c.work.group) == (COMPILED, "10 balls")]
    few.setattr(measurement, "cases", lambda: some)
    few.setattr(measurement, "in_a_fresh_process", in_this_process)
    try:
        events = list(run.run(["timing"], "quick", folder))
    finally:
        few.undo()
    assert {event.state for event in events} == {run.MEASURING, run.MEASURED}
    return folder


def test_every_case_is_kept_with_rounds_of_one_operation_each(folder):
    *records, finished = RecordFile(folder).read().records
    assert (finished.suite, finished.problem) == ("finished", "timing")
    assert {record.settings["operations"] for record in records} == {1, 10_000, 50_000}
    for record in records:
        assert not record.failed
        assert len(record.measured["seconds"]) == SWEEPS
        assert SWEEPS <= record.measured["seconds"].size <= 10 * ROUNDS
        assert (record.measured["seconds"] > 0).all()
        assert record.size == 0.001
        assert record.measured["noise"] > 0
        assert record.stamp["machine"] == stamp()["machine"]
        assert record.measured["subject"] == "kinematics"
    assert len({record.measured["together"] for record in records}) == 1


def fails():
    raise OSError("no engine")


@pytest.fixture
def compared(monkeypatch):
    """The names of two cases as they are called, compared with a third that fails."""
    called = []
    made = [TimedCase(WORK, name, lambda name=name: lambda: called.append(name)) for name in "ab"]
    made.append(TimedCase(WORK, "c", fails))
    monkeypatch.setattr(measurement, "cases", lambda: tuple(made))
    monkeypatch.setattr(measurement, "in_a_fresh_process", in_this_process)
    return called


def test_cases_that_are_compared_alternate_in_an_order_by_seed(compared):
    called = compared
    orders = []
    for _ in range(2):
        called.clear()
        result = measurement.sweep("s", "g", 0.001)
        orders.append([name for name, _ in itertools.groupby(called)])
        assert all(np.shape(rounds)[0] == SWEEPS for rounds in result["rounds"][:2])
    assert orders[0] == orders[1]
    assert len(orders[0]) >= SWEEPS
    assert len(result["paces"]) == 3 * SWEEPS


@pytest.mark.usefixtures("compared")
def test_a_case_that_fails_costs_none_that_it_is_compared_with():
    results = measurement.sweep("s", "g", 0.001)
    assert results["rounds"][2] == []
    assert results["troubles"] == ["", "", "OSError: no engine"]
    first, *_, last = measurement.blocks(Scale(1, 0.001))
    assert first.measure()["seconds"].shape[0] == SWEEPS
    with pytest.raises(RuntimeError, match="OSError: no engine"):
        last.measure()


@pytest.mark.usefixtures("compared")
def test_a_group_is_timed_once_in_a_run_and_again_in_the_next():
    runs = []
    for _ in range(2):
        a, b, _ = measurement.blocks(Scale(1, 0.001))
        runs.append({block.measure()["together"] for block in (a, b, a)})
    assert [len(words) for words in runs] == [1, 1]
    assert runs[0] != runs[1]


@pytest.mark.parametrize(("single", "expected"), [(1.0, (1, 1)), (1e-5, (100, 22)), (0.01, (1, 2))])
def test_rounds_are_as_long_and_as_many_as_the_time_allows(single, expected):
    timer = SimpleNamespace(timeit=lambda n: n * single, repeat=lambda n, loops: [loops * single])
    assert measurement.shape(timer, 0.2) == expected


def test_reading_the_clock_takes_less_than_a_hundredth_of_a_round():
    """The processor's clock takes ten times as long as this call."""
    seconds = lambda n: 2e-6 + 2e-7 * n  # noqa: E731
    timer = SimpleNamespace(timeit=seconds, repeat=lambda n, loops: [seconds(loops)])
    loops, _ = measurement.shape(timer, 0.2)
    assert 0.01 * loops * 2e-7 > 2e-6


def test_work_on_one_core_is_timed_by_the_processors_clock(monkeypatch):
    """Other programs on the core cost a case nothing; work on all cores has the wall clock."""
    clocks = iter(range(10**9))
    tick = {"process_time": lambda: 1e-3 * next(clocks), "perf_counter": lambda: next(clocks)}
    for name, reading in tick.items():
        monkeypatch.setattr(measurement, name, reading)
    for cores, longest in ((1, 2e-3), (None, 2.0)):
        case = TimedCase(WORK, "a", lambda: lambda: None, cores=cores)
        assert longest / 10 < max(next(measurement._rounds(case, 1e-9))) < longest


@pytest.mark.parametrize(
    ("wall", "processor", "expected"),
    [(4.0, 1.0, 1.0), (1.0, 4.0, 1.0), (1e-4, 2e-6, 1e-4)],
    ids=["another program works meanwhile", "several threads", "too short for the clock"],
)
def test_a_solver_is_timed_while_it_computes(monkeypatch, wall, processor, expected):
    now = dict.fromkeys(("perf_counter", "process_time"), 0.0)
    clocks = {name: lambda name=name: now[name] for name in now}
    monkeypatch.setattr(clock, "time", SimpleNamespace(**clocks))
    call = lambda: now.update(perf_counter=wall, process_time=processor)  # noqa: E731
    assert clock.compute_time_of(call) == (None, expected)


def test_a_copy_moves_as_many_bytes_as_it_says(monkeypatch):
    sizes = []
    monkeypatch.setattr(np, "copyto", lambda to, source: sizes.append(to.nbytes + source.nbytes))
    case = copying(WORK, 1600, 3)
    case.prepare()()
    assert (sizes, case.moved, case.solver) == ([1600] * 3, 4800, LIMIT)


@pytest.mark.parametrize(("cores", "minimum", "slices"), [(1, 0, 1), (3, 8, 3 * 4)])
def test_a_stream_reads_and_writes_all_that_it_says(cores, minimum, slices, monkeypatch):
    sizes = []

    def watched(source, sink):
        stream(source, sink)
        sizes.append((source.nbytes, sink.nbytes))
        assert (sink[: len(source)] == 2.0).all()
        assert (sink[len(source) :] == 1.0).all()

    monkeypatch.setattr(timing_cases, "_stream", watched)
    case = streaming(WORK, 320, 560, cores=cores, minimum=minimum)
    with set_num_threads(cores):
        case.prepare()()
    assert len(sizes) == slices
    assert [sum(column) for column in zip(*sizes, strict=True)] == [320, 560]
    assert (case.moved, case.solver, case.cores) == (320 + 2 * 560, LIMIT, cores)


def test_every_batch_moves_what_its_limit_moves_on_as_many_cores():
    cases = list(timing_cases.kinematics_cases())
    limits = {case.work.problem: case for case in cases if case.solver == LIMIT}
    for case in cases:
        limit = limits[case.work.problem]
        assert (limit.cores, limit.operations) == (case.cores, case.operations)
    assert {case.cores for case in cases} == {1, None}
    for name, (skeleton, batch) in timing_cases.skeletons().items():
        rotations = np.zeros((batch, skeleton.joint_count, 4))
        rotations[..., 0] = 1.0
        pose = forward_kinematics(skeleton, rotations)
        limit = limits[f"kinematics/{name}/{batch:,} poses a call"]
        output = pose.positions.nbytes + pose.rotations.nbytes
        assert limit.moved == rotations.nbytes + 2 * output


@pytest.mark.parametrize(("integrator", "count"), [("Euler", 10), ("discrete", 1)])
def test_mujoco_is_timed_from_its_own_state_without_conversions_and_energies(
    monkeypatch, integrator, count
):
    """They were 15 to 25 % of its time."""
    problem = cloth_swing(1, size=5)
    start = timing_cases.moving(problem)
    engine = MujocoMassSpring(problem.system, h=problem.h / count, integrator=integrator)
    expected = engine.step(start, steps=count).positions
    call = timing_cases.mujoco_steps(problem, integrator, count, is_tight=True)
    for name in ("write", "read"):
        monkeypatch.setattr(MujocoMassSpring, name, None)
    call()
    engine = call()  # from the saved state again
    monkeypatch.undo()
    np.testing.assert_array_equal(engine.read().positions, expected)
    assert np.abs(expected - start.positions).max() > 1e-4
    assert not engine.model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_ENERGY


def test_mujoco_is_timed_at_its_default_tolerance_and_shown_at_a_tight_one_with_both_errors():
    """The errors are distances to our step; one that is only shown leads nowhere."""
    default, problem = mujoco.MjOption(), cloth_swing(1)
    cases = {case.solver: case for case in timing_cases.cloth_cases()
             if case.work.problem == "cloth/x1/implicit Euler, linearised once"}  # fmt: skip
    start = timing_cases.moving(problem).positions
    step = ImplicitEuler(problem.system, h=problem.h, solver="gauss_newton")
    exact = step.step(timing_cases.moving(problem)).state.positions
    errors = {}
    for solver in ("MuJoCo", TIGHT):
        engine = cases[solver].prepare()()
        errors[solver] = cases[solver].error()
        left = np.linalg.norm(engine.read().positions - exact) / np.linalg.norm(start - exact)
        assert errors[solver] == pytest.approx(left, rel=1e-6)
        tolerance, iterations = engine.model.opt.tolerance, engine.model.opt.iterations
        if solver == "MuJoCo":
            assert (tolerance, iterations) == (default.tolerance, default.iterations)
        else:
            assert tolerance == 1e-15
    assert 1e-13 > errors[TIGHT] < errors["MuJoCo"] < 1e-7
    assert catalogue.find("MuJoCo").ranked
    assert not catalogue.find(TIGHT).ranked


@pytest.mark.usefixtures("compared")
def test_the_error_of_a_case_is_on_record(monkeypatch):
    case = TimedCase(WORK, "d", lambda: list, error=lambda: 0.25)
    monkeypatch.setattr(measurement, "cases", lambda: (case,))
    assert measurement.measure_case("run", case, 0.001)["error"] == 0.25


def test_mujoco_has_the_pose_before_only_where_that_is_said():
    skeleton, _ = timing_cases.skeletons()["10 balls"]
    engine = SKELETON_ENGINES["MuJoCo"](skeleton)
    engine.update_kinematics(coordinates(engine, timing_cases._local_rotations(skeleton)))
    model, data = timing_cases.preset_pose(skeleton).args
    np.testing.assert_array_equal(data.xpos, engine.data.xpos)
    data.xpos[:] = 0.0
    timing_cases.preset_pose(skeleton)()
    mujoco.mj_kinematics(model, data)
    np.testing.assert_array_equal(data.xpos, engine.data.xpos)


def test_a_loop_over_an_engine_ends_in_the_last_pose_of_our_batch():
    skeleton, _ = timing_cases.skeletons()["30-joint tree"]
    batch = timing_cases.compiled_poses(skeleton, 3)().positions
    for name in SKELETON_ENGINES:
        loop = timing_cases.engine_poses(name, skeleton, 3)
        call = inspect.getclosurevars(loop).nonlocals["call"]
        assert len(loop()) == 3
        if name == "Pinocchio":
            import pinocchio

            assert call.func is pinocchio.forwardKinematics, "no method of ours takes its time"
            positions = [placement.translation for placement in call.args[1].oMi][1:]
        else:
            positions = call.__self__.pose().positions
        np.testing.assert_allclose(positions, batch[-1], atol=1e-13)


@pytest.mark.parametrize("name", timing_cases.ROBOTS)
def test_kinematics_and_jacobians_of_a_robot_are_equal_in_all_engines(name):
    if not is_installed(name):
        pytest.skip("the package of robots is not installed")
    timed = robot(name)
    model = (urdf.parse if timed.is_chain else mjcf.parse)(timed.text).articulation
    tip, link = model.index(timed.effectors[0]), timed.effectors[0]
    pose = timing_cases.timed_call("kinematics", COMPILED, name, 1)()
    prepared = timing_cases.timed_call("kinematics", PREPARED, name, 1)()
    data = timing_cases.timed_call("kinematics", "MuJoCo", name, 1)()
    call = timing_cases.timed_call("kinematics", "Pinocchio", name, 1)
    call()
    engine_model, engine_data = call.args[:2]
    positions = [
        prepared.positions[tip],
        data.body(link).xpos,
        engine_data.oMf[engine_model.getFrameId(link)].translation,
    ]
    np.testing.assert_allclose(positions, [pose.positions[tip]] * 3, atol=1e-13)
    batch = timing_cases.timed_call("jacobians", COMPILED, name, 3)()
    for engine in ("Pinocchio", "MuJoCo"):
        *_, last = timing_cases.timed_call("jacobians", engine, name, 3)()
        np.testing.assert_allclose(last, batch[-1], atol=1e-13)
        single = timing_cases.timed_call("jacobians", engine, name, 1)()
        np.testing.assert_allclose(single, batch[0], atol=1e-13)


def test_robots_are_timed_by_us_and_by_both_engines_a_pose_and_a_batch():
    solvers = {case.work.problem: set() for case in timing_cases.robot_cases()}
    for case in timing_cases.robot_cases():
        solvers[case.work.problem].add(case.solver)
        assert case.operations == (1 if "one pose" in case.work.title else timing_cases.POSES)
    assert all({COMPILED, "Pinocchio", "MuJoCo"} <= names for names in solvers.values())
    assert {problem.partition("/")[0] for problem in solvers} == {"kinematics", "jacobians"}
