"""Workers of a Dask cluster: the same answers as one process, each row once, whoever is lost."""

import contextlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from concurrent.futures import Future
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from plumbob.bench.experiments import EXPERIMENTS, SCALES, Block, Measured, Scale, blocks
from plumbob.bench.harness import run, values
from plumbob.bench.harness.block import Choice
from plumbob.bench.harness.executors import dask, executor_at, work
from plumbob.bench.harness.machine import stamp
from plumbob.bench.harness.measure import block_key, measure
from plumbob.bench.harness.progress import Progress, listening
from plumbob.bench.harness.record import RecordFile, decode, encode
from plumbob.bench.harness.values import Values
from plumbob.bench.peers.entrant import Entrant
from plumbob.bench.peers.sources import digest_of
from plumbob.bench.report.sections import tables
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.writers import markdown
from plumbob.cli import main as cli

TINY = Scale(targets=3, seconds=0.001)
ROOT = Path(__file__).parents[2]
INSTALLED = "the extra `cluster` is not installed"


class Numbers(Values, frozen=True):
    x: list


def rows(folder):
    """How often each row was written."""
    lines = map(decode, RecordFile(folder).path.read_text().splitlines())
    return Counter(record.key for record in lines if record.solver)


def records(folder):
    return [record for record in RecordFile(folder).read().records if record.solver]


def processors(folder):
    """The machines of the timed records."""
    timed = [record for record in records(folder) if record.suite != "arm"]
    return {record.stamp["machine"]["processor"] for record in timed}


def states(events):
    return Counter(event.state for event in events)


@pytest.fixture(autouse=True)
def tiny(monkeypatch):
    monkeypatch.setitem(SCALES, "quick", TINY)


@pytest.fixture
def few(monkeypatch):
    """Let a run ask for few blocks of a suite only; workers know them all."""

    def choose(**counts):
        def some(suite, scale):
            found = [block for block in blocks(suite, scale) if "robots" not in block.problem]
            return iter(found[: counts[suite]])

        monkeypatch.setattr(run, "blocks", some)
        return {block_key(block) for suite in counts for block in some(suite, TINY)}

    return choose


# What takes times says so.


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda e: e.package.rsplit(".")[-1])
def test_every_experiment_states_whether_it_takes_times(experiment):
    """One that reads the stopwatch or keeps seconds shares no machine while it is measured."""
    folder = ROOT / Path(*experiment.package.split(".")[1:])
    files = [path for path in folder.glob("*.py") if path.name != "tables.py"]
    text = "".join(path.read_text(encoding="utf-8") for path in files)
    words = ("stopwatch", '"seconds"', ".seconds", "times_in_turns", "RobotJob")
    assert experiment.times == any(word in text for word in words)
    assert {block.times for block in experiment.blocks(TINY)} == {experiment.times}


# Addresses and complaints.


EXPECTED, NO_EXTRA = "--executor: expected local or dask://HOST:PORT, got", ".[cluster]"


@pytest.mark.parametrize(
    ("address", "words"),
    [(one, EXPECTED) for one in ("", "slurm", "dask:/a:1", "dask://a", "dask://:1", "dask://a:b")]
    + [("dask://127.0.0.1:1", NO_EXTRA)],
)
def test_an_address_of_no_executor_is_misuse(monkeypatch, capsys, address, words, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    arguments = ["bench", "arm", "--executor", address, "-o", str(tmp_path / "out")]
    assert cli.run_command(arguments) == 2
    assert words in capsys.readouterr().err


OTHERS = {
    "nobody": (None, "got no answer within 0.5 s"),
    "silence": (b"", "got no answer within 0.5 s"),
    "garbage": (b"garbage " * 1000, "got an answer of something else"),
    "zeros": (bytes(8000), "got an answer of something else"),
    "HTTP": (b"HTTP/1.0 400 Bad Request\r\n\r\n", "got an answer of something else"),
}


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[] if one in ("nobody", "zeros") else pytest.mark.slow)
     for one in OTHERS],
)  # fmt: skip
def test_another_server_at_the_address_is_misuse(name):
    """A Client waits for its answer for ever, so that this one has a process of its own."""
    pytest.importorskip("distributed", reason=INSTALLED)
    answer, why = OTHERS[name]
    with socket.create_server(("127.0.0.1", 0)) as server, contextlib.ExitStack() as ends:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        if answer is None:
            server.close()
        else:
            thread = threading.Thread(target=_serve, args=(server, answer), daemon=True)
            thread.start()
            ends.callback(thread.join)
            ends.callback(server.shutdown, socket.SHUT_RDWR)  # closing does not end its wait
        program = (
            "from plumbob.bench.harness.executors.dask import DaskExecutor\n"
            f"try: DaskExecutor('{address}', answer=0.5)\n"
            "except ValueError as error: print(error)"
        )
        command, options = [sys.executable, "-c", program], {"capture_output": True, "text": True}
        done = subprocess.run(command, cwd=ROOT, check=True, timeout=90, **options)
    assert done.stdout == f"dask://{address}: expected a Dask scheduler, {why}\n"
    assert not done.stderr


def _serve(server, answer):
    with contextlib.ExitStack() as connections, contextlib.suppress(OSError):
        while True:
            connections.enter_context(server.accept()[0]).sendall(answer)


# A cluster made up: hosts, workers and machines that come and go as we say.


class MadeUpFuture(Future):
    def __init__(self, key):
        super().__init__()
        self.key = key


class MadeUpCluster:
    """Workers that measure blocks in this process; `lose` lists the tasks that end a worker."""

    def __init__(self, lose=(), **workers):
        self.workers = {name: machine.split("/") for name, machine in workers.items()}
        self.lose, self.given, self.running = set(lose), [], 0

    def nthreads(self):
        return dict.fromkeys(self.workers, 1)

    def wait_for_workers(self, count, timeout):
        if len(self.workers) < count:
            raise TimeoutError

    def run(self, function, workers, on_error):
        return {name: self.place(name) for name in workers}

    def place(self, name):
        host, machine = self.workers[name]
        return {"host": host, "stamp": {**stamp(), "machine": {"processor": machine}}}

    def close(self, timeout):
        pass

    def subscribe_topic(self, topic, handler):
        pass

    def submit(self, function, suite, scale, name, *arguments, key, workers=None):
        future = MadeUpFuture(key)
        if not self.workers:
            return future
        (at,) = workers or [next(iter(self.workers))]
        self.given.append((suite, at if workers else None))
        if len(self.given) in self.lose:
            del self.workers[at]
            return future
        (block,) = (b for b in PLANTED if block_key(b) == name)
        made = replace(measure(block), stamp=self.place(at)["stamp"])
        future.set_result({"line": encode(made)})
        return future

    def hosts(self, suite):
        """The hosts of what was given out of a suite, in order; None where any would do."""
        return [at and HOSTS[at] for name, at in self.given if name == suite]


HOSTS = {"w1": "h1", "w2": "h1", "w3": "h2", "w4": "h3"}
ONE_KIND = {"w1": "h1/slide rule", "w2": "h1/slide rule", "w3": "h2/slide rule"}
TWO_KINDS = ONE_KIND | {"w4": "h3/abacus"}
PLANTED = [
    Block(suite, problem, "s", lambda: Measured(Numbers([1.0])), times=times)
    for suite, times in (("arm", False), ("ik", True), ("timing", True))
    for problem in ("a", "b", "c")
]


@pytest.fixture
def made_up(monkeypatch, tmp_path):
    """Run the planted suites on a made-up cluster; return what happened."""
    pytest.importorskip("distributed", reason=INSTALLED)
    monkeypatch.setattr(run, "blocks", lambda suite, _: (b for b in PLANTED if b.suite == suite))
    monkeypatch.setattr(dask, "_LOOK", 0.01)
    monkeypatch.setattr(values, "kind_of", lambda *_: None)  # no experiment declares these

    def go(cluster, mix=False):
        monkeypatch.setattr(dask, "_connected", lambda *_: cluster)
        executor = dask.DaskExecutor("made:1", mix, workers=0.1)
        return list(run.run(["arm", "ik", "timing"], "quick", tmp_path, executor))

    return go


def test_times_stay_on_one_machine_and_a_suite_on_one_host(made_up, tmp_path):
    cluster = MadeUpCluster(**TWO_KINDS)
    assert states(made_up(cluster)) == {run.MEASURING: 9, run.MEASURED: 9}
    assert cluster.hosts("arm") == [None] * 3
    assert [set(cluster.hosts(suite)) for suite in ("ik", "timing")] == [{"h1"}, {"h2"}]
    assert processors(tmp_path) == {"slide rule"}


def test_machines_are_mixed_on_request(made_up):
    cluster = MadeUpCluster(**TWO_KINDS)
    made_up(cluster, mix=True)
    assert set(cluster.hosts("ik")) == {"h1", "h2", "h3"}
    assert states(made_up(MadeUpCluster(w4="h3/abacus"), mix=True)) == {run.KEPT: 9}


def test_a_host_measures_timed_blocks_in_order(made_up):
    events = made_up(MadeUpCluster(w1="h1/x", w2="h1/x"))
    steps = [event.state for event in events if event.suite != "arm"]
    assert steps == [run.MEASURING, run.MEASURED] * 6


def test_another_host_of_the_machine_takes_over_from_a_lost_one(made_up, tmp_path):
    cluster = MadeUpCluster(lose={5}, w1="h1/slide rule", w3="h2/slide rule", w4="h3/abacus")
    assert states(made_up(cluster)) == {run.MEASURING: 9, run.MEASURED: 9}
    assert set(rows(tmp_path).values()) == {1}
    assert len(rows(tmp_path)) == 9


def test_times_are_taken_on_the_chosen_machine_only_until_the_next_run(made_up, tmp_path):
    workers = {"w1": "h1/slide rule", "w2": "h1/slide rule", "w4": "h3/abacus"}
    events = made_up(MadeUpCluster(lose={6, 7}, **workers))
    failures = [event.message for event in events if event.state == run.FAILED]
    assert failures
    assert all("slide rule" in message for message in failures)
    made_up(MadeUpCluster(w4="h3/abacus"))
    assert processors(tmp_path) == {"abacus"}


def test_the_machine_with_most_records_continues_and_other_answers_are_kept(made_up):
    made_up(MadeUpCluster(w4="h3/abacus"))
    assert states(made_up(MadeUpCluster(**TWO_KINDS))) == {run.KEPT: 9}
    again = made_up(MadeUpCluster(**ONE_KIND))
    assert states(again) == {run.KEPT: 3, run.MEASURING: 6, run.MEASURED: 6}
    assert any("times are taken on another machine (slide rule)" in e.message for e in again)


def test_rows_of_a_table_are_timed_on_the_same_machine(made_up, monkeypatch):
    made_up(MadeUpCluster(**ONE_KIND))
    some = Choice("quick", TINY, problems=("a", "b"), is_partial=True)
    monkeypatch.setattr(run, "choice_at", lambda scale: some)
    assert states(made_up(MadeUpCluster(**TWO_KINDS)))[run.KEPT] == 6
    elsewhere = made_up(MadeUpCluster(w4="h3/abacus"))
    assert states(elsewhere) == {run.KEPT: 2, run.FAILED: 4, run.NOT_RUN: 3}
    assert "timed on another machine than is here (slide rule; here abacus)" in elsewhere[2].message
    mixed = made_up(MadeUpCluster(w4="h3/abacus"), mix=True)
    assert states(mixed)[run.KEPT] == 6


def test_a_run_without_workers_ends_and_can_be_continued(made_up, tmp_path):
    with pytest.raises(ValueError, match=r"expected a worker, got none within 0\.1 s"):
        made_up(MadeUpCluster())
    with pytest.raises(ValueError, match="no worker is left"):
        made_up(MadeUpCluster(lose={2}, w1="h1/x"))
    counts = states(made_up(MadeUpCluster(w1="h1/x")))
    assert counts == {run.KEPT: 1, run.MEASURING: 8, run.MEASURED: 8}
    assert set(rows(tmp_path).values()) == {1}


# A worker.


@pytest.mark.parametrize("part", [{"versions": {"numpy": "0"}}, {"source": "0"}])
def test_a_worker_with_other_versions_or_sources_refuses(made_up, part):
    other = {**stamp(), **part}
    block = ("arm", pickle.dumps(TINY), ("arm", "no such", "s", "{}"), False)
    assert "other" in work.perform(*block, other, "")["refused"]
    for reply, words in (
        ({"host": "h1", "stamp": other}, "what is installed here, got other"),
        (ModuleNotFoundError("No module named 'bench'"), "Plumbob, got No module named"),
    ):
        cluster = MadeUpCluster(w1="h1/x")
        cluster.place = lambda name, reply=reply: reply
        with pytest.raises(ValueError, match=f"worker w1: expected {words}"):
            made_up(cluster)


def test_a_users_solver_must_have_the_same_files_on_the_worker(tmp_path):
    path = tmp_path / "my_ik.py"
    path.write_text("def inverse_kinematics(request):\n    return request\n")
    entrant = Entrant("Mine", str(path), str(path), digest=digest_of(str(path)))
    scale, key = pickle.dumps(replace(TINY, entrants=(entrant,))), ("arm", "p", "s", "{}")
    found = work.measured("arm", scale, key)
    assert found == {"refused": "there is no block arm, p, s, {}"}
    work._blocks.cache_clear()
    path.write_text("raise SystemExit")
    assert "got other ones (" in work.measured("arm", scale, key)["refused"]
    path.unlink()
    assert f"expected the files of {path}, got none" in work.measured("arm", scale, key)["refused"]


def test_a_machine_is_shared_by_answers_and_not_by_times(tmp_path, monkeypatch):
    monkeypatch.setattr(work.tempfile, "gettempdir", lambda: str(tmp_path))
    waited = []

    def take_times():
        with work._machine_to_itself(True):
            waited.append(time.monotonic())

    with work._machine_to_itself(False), work._machine_to_itself(False):
        thread = threading.Thread(target=take_times)
        thread.start()
        thread.join(0.1)
        assert not waited
    thread.join()
    assert waited


@pytest.mark.parametrize("words", ["got a link", "another user's"])
def test_a_lock_of_another_user_is_not_taken(tmp_path, monkeypatch, words):
    """Everyone may write to the folder of temporary files: a link would lead to any file."""
    monkeypatch.setattr(work.tempfile, "gettempdir", lambda: str(tmp_path))
    user = os.getuid()
    if words == "got a link":
        (tmp_path / f"plumbob-{user}.lock").symlink_to(tmp_path / "file")
    else:
        monkeypatch.setattr(work.os, "getuid", lambda: user + 1)
    with pytest.raises(ValueError, match=words), work._machine_to_itself(True):
        pass
    assert not (tmp_path / "file").exists()


def test_the_progress_of_a_worker_is_reported(made_up, monkeypatch):
    """Long steps are said while they last, as in one process."""
    cluster = MadeUpCluster(w1="h1/x")
    cluster.subscribe_topic = lambda topic, handler: setattr(cluster, "tell", handler)
    submit = cluster.submit

    def tell_and_submit(*given, **where):
        cluster.tell((0.0, list(Progress(f"step {len(cluster.given)}"))))
        return submit(*given, **where)

    cluster.submit = tell_and_submit
    heard = []
    with listening(lambda progress: heard.append(progress.subject)):
        made_up(cluster)
    assert heard == [f"step {i}" for i in range(9)]


# A cluster that is real: two workers, each a process of this machine.


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed", reason=INSTALLED)
    given = {"threads_per_worker": 1, "processes": True, "dashboard_address": ":0"}
    with distributed.LocalCluster(n_workers=2, host="127.0.0.1", **given) as cluster:
        yield cluster


@pytest.fixture
def executor(cluster):
    with closing(executor_at(address(cluster))) as executor:
        yield executor


def address(cluster):
    return cluster.scheduler_address.replace("tcp://", "dask://")


def results(folder, suites, *executor):
    """All tables as text, and all arrays."""
    list(run.run(suites, "quick", folder, *executor))
    all_tables = tables(Results(RecordFile(folder).read().records), suites)
    texts = {table.name: markdown(table) for table in all_tables if table.rows}
    arrays = {r.key: {n: a.tobytes() for n, a in r.arrays.items()} for r in records(folder)}
    return texts, arrays


def assert_same_tables(suites, executor, folder):
    local = results(folder / "one", suites)
    assert local[0]
    assert results(folder / "two", suites, executor) == local


def test_two_workers_give_the_same_tables_to_the_bit_as_one_process(executor, few, tmp_path):
    few(arm=20, tracking=14)
    assert_same_tables(["tracking", "arm"], executor, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("suite", sorted({e.suite for e in EXPERIMENTS if not e.times}))
def test_every_suite_gives_the_same_tables_on_two_workers(executor, monkeypatch, suite, tmp_path):
    monkeypatch.setattr(run, "blocks", lambda *suite: (b for b in blocks(*suite) if not b.times))
    assert_same_tables([suite], executor, tmp_path)


def pids(cluster):
    from distributed import Client

    with Client(cluster.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=30)
        return list(client.run(os.getpid).values())


@pytest.mark.parametrize(
    ("suite", "count"), [("arm", 30), pytest.param("cloth_scale", 2, marks=pytest.mark.slow)]
)
def test_a_worker_killed_in_the_middle_costs_no_row_and_doubles_none(
    cluster, executor, few, tmp_path, suite, count
):
    (asked, (worker, _)), heard = (few(**{suite: count}), pids(cluster)), []
    with listening(heard.append):
        for event in run.run([suite], "quick", tmp_path, executor):
            if event.state == run.MEASURED and len(rows(tmp_path)) == 1:
                os.kill(worker, signal.SIGKILL)
    assert bool(heard) is (suite == "cloth_scale")
    assert worker not in pids(cluster)
    assert rows(tmp_path) == dict.fromkeys(asked, 1)
    assert not any(record.failed for record in records(tmp_path))
    assert all(record.stamp == stamp() for record in records(tmp_path))
