"""Workers of a Dask cluster: the same answers as one process, each row once, whoever is lost."""

import contextlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from plumbob.bench.experiments import EXPERIMENTS, SCALES, Block, Scale, blocks
from plumbob.bench.measure import run
from plumbob.bench.measure.executors import dask, executor_at
from plumbob.bench.measure.machine import measuring_part, stamp
from plumbob.bench.measure.measure import block_key
from plumbob.bench.measure.record import Record, RecordFile, decode
from plumbob.bench.page.sections import tables
from plumbob.bench.peers.sources import digest_of
from plumbob.bench.peers.user_solver import UserSolver
from plumbob.bench.tables.results import Results
from plumbob.bench.tables.writers import markdown
from plumbob.cli import main as cli

TINY = Scale(targets=3, seconds=0.001)
ROOT = Path(__file__).parents[2]
INSTALLED = "the extra `cluster` is not installed"


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


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda e: e.module.rsplit(".")[-1])
def test_every_experiment_states_whether_it_takes_times(experiment):
    """One that reads the stopwatch or keeps seconds shares no machine while it is measured."""
    path = ROOT / Path(*experiment.module.split(".")[1:]).with_suffix(".py")
    text = measuring_part(path).decode()
    text = text.replace('scale.seconds == SCALES["quick"].seconds', "")  # no time of a solver
    words = ("clock import", "ChainJob", '"seconds"', ".seconds", "times_in_turns", "RobotJob")
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


OTHERS = {"zeros": bytes(8000), "nobody": None, "silence": b"", "garbage": b"garbage " * 1000}
OTHERS["HTTP"] = b"HTTP/1.0 400 Bad Request\r\n\r\n"


@pytest.mark.sample("zeros")
@pytest.mark.parametrize("answer", OTHERS.values(), ids=OTHERS)
def test_another_server_at_the_address_is_misuse(answer):
    """A Client waits for its answer for ever, so that this one has a process of its own."""
    pytest.importorskip("distributed", reason=INSTALLED)
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
            "from plumbob.bench.measure.executors.dask import DaskExecutor\n"
            f"try: DaskExecutor('{address}', answer=0.5)\n"
            "except ValueError as error: print(error)"
        )
        command, options = [sys.executable, "-c", program], {"capture_output": True, "text": True}
        done = subprocess.run(command, cwd=ROOT, check=True, timeout=90, **options)
    why = "expected a Dask scheduler, got no answer of one within 0.5 s"
    assert done.stdout == f"dask://{address}: {why}\n"
    assert not done.stderr


def _serve(server, answer):
    with contextlib.ExitStack() as connections, contextlib.suppress(OSError):
        while True:
            connections.enter_context(server.accept()[0]).sendall(answer)


# A worker.


@pytest.mark.parametrize("part", [{"versions": {"numpy": "0"}}, {"source": "0"}])
def test_a_worker_with_other_versions_or_sources_refuses(part):
    client = {**stamp(), "machine": {}, **part}
    refused = dask.perform("arm", b"", ("arm", "no such", "s", "{}"), client)["refused"]
    assert refused.startswith("expected a worker with what is installed here, got other")


def test_a_users_solver_must_have_the_same_files_on_the_worker(tmp_path):
    path = tmp_path / "my_ik.py"
    path.write_text("def inverse_kinematics(request):\n    return request\n")
    entrant = UserSolver("Mine", str(path), str(path), digest=digest_of(str(path)))
    scale, key = pickle.dumps(replace(TINY, user_solvers=(entrant,))), ("arm", "p", "s", "{}")
    found = dask.measured("arm", scale, key)
    assert found == {"refused": "there is no block arm, p, s, {}"}
    dask._blocks.cache_clear()
    path.write_text("raise SystemExit")
    assert "got other ones (" in dask.measured("arm", scale, key)["refused"]
    path.unlink()
    assert f"expected the files of {path}, got none" in dask.measured("arm", scale, key)["refused"]


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
    arrays = {r.key: {n: a.tobytes() for n, a in r.numbers().items()} for r in records(folder)}
    return texts, arrays


def assert_same_tables(suites, executor, folder):
    local = results(folder / "one", suites)
    assert local[0]
    assert results(folder / "two", suites, executor) == local


@pytest.mark.slow
@pytest.mark.parametrize("suite", sorted({e.suite for e in EXPERIMENTS if not e.times}))
def test_every_suite_gives_the_same_tables_on_two_workers(executor, monkeypatch, suite, tmp_path):
    monkeypatch.setattr(run, "blocks", lambda *suite: (b for b in blocks(*suite) if not b.times))
    assert_same_tables([suite], executor, tmp_path)


def test_times_are_taken_by_one_worker_and_by_none_if_it_is_lost(cluster, executor, monkeypatch):
    submitted = []
    monkeypatch.setattr(executor._client, "submit", lambda *_, **where: submitted.append(where))
    monkeypatch.setattr(executor, "_completed", lambda futures: ())
    timed = [Block("ik", name, "s", None, times=True) for name in "ab"]
    assert list(executor.measure(timed, TINY)) == timed
    assert submitted == [{"pure": False, "workers": [executor._timer]}] * 2
    monkeypatch.setattr(executor, "_timer", "tcp://10.0.0.1:1")
    reasons = [step.reason for step in executor.measure(timed, TINY)]
    assert reasons == ["the worker that takes times, tcp://10.0.0.1:1, is lost"] * 2


def test_answers_are_kept_whatever_the_machine_and_times_are_not(executor):
    elsewhere = Record("ik", "a", "s", {}, stamp={**stamp(), "machine": {"processor": "abacus"}})
    answers, times = (Block("ik", "a", "s", None, times=timed) for timed in (False, True))
    assert executor.difference(answers, elsewhere) == ""
    assert executor.difference(times, elsewhere).startswith("another machine (processor abacus")


def pids(cluster):
    from distributed import Client

    with Client(cluster.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=30)
        return list(client.run(os.getpid).values())


@pytest.mark.slow
def test_a_worker_killed_in_the_middle_costs_no_row_and_doubles_none(
    cluster, executor, few, tmp_path
):
    suite, count = "arm", 30
    asked, (worker, _) = few(**{suite: count}), pids(cluster)
    for event in run.run([suite], "quick", tmp_path, executor):
        if event.state == run.MEASURED and len(rows(tmp_path)) == 1:
            os.kill(worker, signal.SIGKILL)
    assert worker not in pids(cluster)
    assert rows(tmp_path) == dict.fromkeys(asked, 1)
    assert not any(record.failed for record in records(tmp_path))
    assert all(record.stamp == stamp() for record in records(tmp_path))
