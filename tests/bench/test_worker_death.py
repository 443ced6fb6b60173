"""A worker may die, hang or talk nonsense at any moment: it costs its job a sentence, no more."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from plumbob.bench.harness import isolation
from plumbob.bench.harness.isolation import WorkerProcess
from plumbob.bench.harness.worker import Ready
from plumbob.crosscheck.child_process import PipedProcess

ROOT = Path(isolation.__file__).resolve().parents[2]
PATIENCE = 3.0
LARGE = 2**22

# A job that lets its worker end in some manner at some moment, and one that does what it should.
JOBS = """
import ctypes, gc, os, pickle, signal, struct, subprocess, sys, time
from multiprocessing.connection import Connection
import numpy as np
from plumbob.bench.harness.worker import Done, Ready, Solved

def descriptor():
    (own,) = [o for o in gc.get_objects() if isinstance(o, Connection)]
    return own.fileno()

def leave():
    os._exit(3)

def go():
    sys.exit(4)

def kill():
    os.kill(os.getpid(), signal.SIGKILL)

def crash():
    ctypes.string_at(0)

def close():
    os.close(descriptor())
    time.sleep(600)

def hang():
    time.sleep(600)

def stop():
    os.kill(os.getpid(), signal.SIGSTOP)

def rubbish():
    os.write(descriptor(), struct.pack("!i", 5) + b"hello")
    time.sleep(600)

def stranger():
    data = pickle.dumps(42)
    os.write(descriptor(), struct.pack("!i", len(data)) + data)
    time.sleep(600)

def raises():
    raise SystemError("from within")

class Dying:
    def __init__(self, manner, moment, load=0):
        self.manner, self.moment, self.load = manner, moment, bytes(load)

    def __setstate__(self, state):
        self.__dict__ = state
        self.die("reading")

    def die(self, moment):
        if moment == self.moment:
            globals()[self.manner]()

    def perform(self):
        self.die("preparing")
        yield Ready(0.5)
        yield Solved(np.zeros(2), 1, 0.1, "")
        self.die("solving")
        if self.moment == "in a message":
            os.write(descriptor(), struct.pack("!i", 1000) + b"cut")
            self.die(self.moment)
        yield Solved(np.ones(2), 1, 0.1, "")
        yield Done()
        self.die("after the last")

class WithChild:
    def __init__(self, path):
        self.path = path

    def perform(self):
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        with open(self.path, "w") as file:
            print(os.getpid(), child.pid, file=file)
        yield Ready(0.0)
        time.sleep(600)
"""
MOMENTS = {"reading": 0, "preparing": 0, "solving": 1, "in a message": 1}
WITHIN = {("rubbish", "in a message"), ("stranger", "in a message")}  # then it is a part of that
SAYS = {
    "leave": "its process ended with code 3",
    "go": "its process ended with code 4",
    "kill": "its process was ended by SIGKILL",
    "crash": "its process was ended by SIGSEGV",
    "close": "its process broke off the connection, or sent what is no message",
    "hang": "ended after .* s of silence",
    "stop": "ended after .* s of silence",
    "raises": "its process ended with code 1",
    "rubbish": "its process broke off the connection, or sent what is no message",
    "stranger": "its process broke off the connection, or sent what is no message",
}


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    """The module of the jobs, which the worker can import too."""
    folder = tmp_path_factory.mktemp("jobs")
    (folder / "dying_jobs.py").write_text(JOBS)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(folder))
        patch.syspath_prepend(folder)
        import dying_jobs

        yield dying_jobs
    sys.modules.pop("dying_jobs", None)


@pytest.fixture
def worker(jobs):
    worker = WorkerProcess(start_patience=PATIENCE, target_patience=0.3)
    yield worker
    worker.close()


def pid(worker):
    return worker._worker.process.pid


def is_gone(process):
    """Whether a process has ended; a zombie, which waits for another parent, has."""
    try:
        return "State:\tZ" in Path(f"/proc/{process}/status").read_text()
    except FileNotFoundError:
        return True


def assert_works(worker, jobs):
    outcome = worker.perform(jobs.Dying("leave", "never"))
    assert (outcome.trouble, len(outcome.solved), outcome.setup) == ("", 2, 0.5)


FEW = {("hang", "preparing"), ("hang", "in a message"), ("stop", "solving"), ("crash", "solving")}
FEW |= {(manner, moment) for manner in ("leave", "kill") for moment in MOMENTS}
FEW |= {("close", "solving"), ("raises", "solving"), ("go", "reading"), ("rubbish", "solving")}
FEW |= {("stranger", "preparing"), ("close", "preparing")}


@pytest.mark.parametrize(
    ("manner", "moment"),
    [
        pytest.param(*both, marks=[] if both in FEW else [pytest.mark.slow])
        for both in ((manner, moment) for manner in SAYS for moment in MOMENTS)
        if both not in WITHIN
    ],
)
def test_a_death_at_any_moment_is_a_sentence_and_costs_no_other_job(worker, jobs, manner, moment):
    if (manner, moment) == ("raises", "reading"):  # that is an answer
        assert worker.perform(jobs.Dying(manner, moment)).trouble == "SystemError: from within"
        return
    with pytest.MonkeyPatch.context() as patch:
        assert_works(worker, jobs)
        before = pid(worker)
        seen = []
        end = PipedProcess.end
        patch.setattr(PipedProcess, "end", lambda w: (seen.append(w.process.pid), end(w)))
        outcome = worker.perform(jobs.Dying(manner, moment))
    assert re.fullmatch(SAYS[manner], outcome.trouble)
    assert len(outcome.solved) == MOMENTS[moment]
    assert outcome.lost == (MOMENTS[moment] > 0)
    assert before in seen
    assert all(is_gone(process) for process in seen)
    assert_works(worker, jobs)


@pytest.mark.parametrize("manner", ["leave", "kill", "close", "stop", "rubbish"])
def test_a_death_after_the_last_message_costs_nothing(worker, jobs, manner):
    outcome = worker.perform(jobs.Dying(manner, "after the last"))
    assert (outcome.trouble, len(outcome.solved)) == ("", 2)
    assert_works(worker, jobs)


STARTS = {
    "raise SystemExit(3)": SAYS["leave"],
    "import os, signal; os.kill(os.getpid(), signal.SIGKILL)": SAYS["kill"],
    "import os, time; os.closerange(3, 99); time.sleep(600)": SAYS["close"],
    "import an_engine_that_nobody_has": SAYS["raises"],
    "import time; time.sleep(600)": SAYS["hang"],
}


@pytest.mark.parametrize("load", [0, LARGE])
@pytest.mark.parametrize("start", STARTS)
def test_a_death_before_the_job_is_read_is_a_sentence(worker, jobs, monkeypatch, start, load):
    """A large job does not fit into what the system keeps for a reader."""
    monkeypatch.setattr(isolation, "_START", start)
    outcome = worker.perform(jobs.Dying("leave", "never", load))
    assert re.fullmatch(STARTS[start], outcome.trouble)
    assert (outcome.solved, outcome.lost) == ([], False)
    monkeypatch.undo()
    assert_works(worker, jobs)


@pytest.mark.parametrize("how", ["close", "interrupt", "silence"])
def test_nothing_is_left_running_not_even_what_a_solver_started(jobs, tmp_path, how):
    worker, path = WorkerProcess(5.0, 0.3 if how == "silence" else 60.0), tmp_path / "processes"
    if how == "silence":
        assert "silence" in worker.perform(jobs.WithChild(path)).trouble
    else:
        messages = worker.stream(jobs.WithChild(path))
        assert isinstance(next(messages), Ready)
        if how == "interrupt":
            with pytest.raises(KeyboardInterrupt):
                messages.throw(KeyboardInterrupt)
        else:
            messages.close()
    deadline = time.monotonic() + 5.0
    processes = [int(word) for word in path.read_text().split()]
    while not all(map(is_gone, processes)) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert len(processes) == 2
    assert all(map(is_gone, processes))


def test_a_worker_ends_with_the_program_that_started_it(jobs, tmp_path):
    """Even if that is killed while a solver sleeps."""
    script = (
        "import sys; import os; from pathlib import Path\n"
        "from plumbob.bench.harness.isolation import WorkerProcess\n"
        "from dying_jobs import WithChild\n"
        "next(WorkerProcess().stream(WithChild(sys.argv[1]))); os.kill(os.getpid(), 9)"
    )
    path = tmp_path / "processes"
    done = subprocess.run([sys.executable, "-c", script, str(path)], cwd=ROOT, check=False)
    assert done.returncode == -signal.SIGKILL
    worker, child = (int(word) for word in path.read_text().split())
    deadline = time.monotonic() + 5.0
    while not is_gone(worker) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert is_gone(worker)
    os.kill(child, signal.SIGKILL)


SHADOW = 'open({path!r}, "a").write(__name__); raise SystemExit("the wrong one")'


@pytest.mark.parametrize("name", ["plumbob", "bench", "numpy", "multiprocessing", "pickle"])
def test_what_lies_where_one_works_is_not_imported(jobs, tmp_path, monkeypatch, name):
    (tmp_path / name).mkdir()
    trace = tmp_path / "imported"
    (tmp_path / name / "__init__.py").write_text(SHADOW.format(path=str(trace)))
    monkeypatch.chdir(tmp_path)
    worker = WorkerProcess(start_patience=60.0)
    try:
        assert_works(worker, jobs)
    finally:
        worker.close()
    assert not trace.exists()


def test_another_bench_on_the_path_is_not_imported(jobs, tmp_path, monkeypatch):
    (tmp_path / "plumbob").mkdir()
    (tmp_path / "plumbob" / "__init__.py").write_text("raise SystemExit(9)")
    path = os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]])
    monkeypatch.setenv("PYTHONPATH", path)
    worker = WorkerProcess(start_patience=60.0)
    assert_works(worker, jobs)
    worker.close()


COMMAND = """
import sys
from functools import partial
from plumbob import cli
from plumbob.bench import experiments as suites
from plumbob.bench.harness import isolation, run
from plumbob.bench.experiments import Block, Measured
from plumbob.bench.experiments.robots import measurement as robots
isolation._START = "raise SystemExit(3)"
import dying_jobs

def measure():
    worker = isolation.WorkerProcess()
    outcome = worker.perform(dying_jobs.Dying("leave", "never", {load}))
    return Measured({{"x": [1.0]}}, {{"remark": outcome.trouble}})

run.blocks = lambda suite, scale: [Block("ik", "p", "s", measure)]
cli.main(["bench", "ik", "--quick", "-o", sys.argv[1]])
"""


def test_the_command_survives_a_worker_that_dies_before_it_reads_its_job(jobs, tmp_path):
    from plumbob.bench.harness.record import RecordFile

    done = subprocess.run(
        [sys.executable, "-c", COMMAND.format(load=LARGE), str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "1 measured" in done.stdout
    notes = [record.notes for record in RecordFile(tmp_path).read().records if record.solver]
    assert notes == [{"remark": "its process ended with code 3"}]
