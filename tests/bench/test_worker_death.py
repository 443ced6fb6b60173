"""A worker may die, hang or send garbage at any moment: it costs its job a sentence, no more."""

import os
import re
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from plumbob.bench.measure import isolation
from plumbob.bench.measure.isolation import Ready, WorkerProcess
from plumbob.process.child import ChildProcess

ROOT = Path(isolation.__file__).resolve().parents[2]
# Silence [s] until a worker is given up that is silent on purpose. No other worker is given up:
# on a busy machine a start may take a minute.
PATIENCE = 2.0

# A job that lets its worker end in some manner at some moment, and one that starts a child.
JOBS = """
import ctypes, gc, os, pickle, signal, struct, subprocess, sys, time
from multiprocessing.connection import Connection
import numpy as np
from plumbob.bench.measure.isolation import Finished, Ready, Solved
from plumbob.bench.peers.protocol import OwnTime

def descriptor():
    (own,) = [o for o in gc.get_objects() if isinstance(o, Connection) and o.writable]
    return own.fileno()

def write(data, size):
    os.write(descriptor(), struct.pack("!i", size) + data)
    time.sleep(600)

class Dying:
    def __init__(self, death, moment, load=0):
        self.death, self.moment, self.load = death, moment, bytes(load)

    def __setstate__(self, state):
        self.__dict__ = state
        self.die("reading")

    def die(self, moment):
        if moment == self.moment:
            exec(self.death, globals())

    def perform(self):
        self.die("preparing")
        yield Ready(0.5)
        yield Solved(np.zeros(2), 1, OwnTime(0.1))
        self.die("solving")
        if self.moment == "in a message":
            os.write(descriptor(), struct.pack("!i", 1000) + b"cut")
            self.die(self.moment)
        yield Solved(np.ones(2), 1, OwnTime(0.1))
        yield Finished()
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
BREAKS_OFF = "its process broke off the connection, or sent what is no message"
SILENT = "ended after .* s of silence"
# How a worker ends, and its sentence.
MANNERS = {
    "leave": ("os._exit(3)", "its process ended with code 3"),
    "go": ("sys.exit(4)", "its process ended with code 4"),
    "kill": ("os.kill(os.getpid(), signal.SIGKILL)", "its process was ended by SIGKILL"),
    "crash": ("ctypes.string_at(0)", "its process was ended by SIGSEGV"),
    "close": ("os.close(descriptor()); time.sleep(600)", BREAKS_OFF),
    "hang": ("time.sleep(600)", SILENT),
    "stop": ("os.kill(os.getpid(), signal.SIGSTOP)", SILENT),
    "raises": ("raise SystemError('from within')", "its process ended with code 1"),
    "rubbish": ("write(b'hello', 5)", BREAKS_OFF),
    "stranger": ("write(pickle.dumps(42), len(pickle.dumps(42)))", BREAKS_OFF),
}
# Garbage in the middle of a message is a part of it, and an exception at reading is an answer.
IMPOSSIBLE = {("rubbish", "in a message"), ("stranger", "in a message"), ("raises", "reading")}
DEATHS = [(m, moment) for m in MANNERS for moment in MOMENTS if (m, moment) not in IMPOSSIBLE]
# Every sentence and every moment once: each death costs the start of a worker, a second.
QUICK = {("leave", "reading"), ("kill", "in a message"), ("stranger", "preparing")}
QUICK |= {("hang", "solving"), ("close", "solving")}


@pytest.fixture(scope="module")
def jobs(importable):
    return importable("dying_jobs", JOBS)


@pytest.fixture(scope="module")
def worker(jobs):
    with closing(WorkerProcess()) as worker:
        yield worker


def outcome_of(worker, job, manner):
    """Perform a job in which a worker ends in a manner, without patience for a silent one."""
    with pytest.MonkeyPatch.context() as patch:
        if MANNERS[manner][1] == SILENT:
            patch.setattr(worker, "patience", PATIENCE)
            patch.setattr(worker, "_start_patience", PATIENCE)
        return worker.perform(job)


def is_gone(process):
    """Whether a process has ended; a zombie, which waits for another parent, has."""
    try:
        return "State:\tZ" in Path(f"/proc/{process}/status").read_text()
    except FileNotFoundError:
        return True


def assert_works(worker, jobs):
    outcome = worker.perform(jobs.Dying("", "never"))
    assert (outcome.trouble, len(outcome.solved), outcome.setup) == ("", 2, 0.5)


@pytest.mark.parametrize(
    ("manner", "moment"),
    [pytest.param(*d, marks=[pytest.mark.slow] if d not in QUICK else []) for d in DEATHS],
)
def test_a_death_at_any_moment_is_a_sentence_and_costs_no_other_job(
    worker, jobs, monkeypatch, manner, moment
):
    assert_works(worker, jobs)
    ended, first, end = [], worker._child.pid, ChildProcess.end
    monkeypatch.setattr(ChildProcess, "end", lambda child: (ended.append(child.pid), end(child)))
    outcome = outcome_of(worker, jobs.Dying(MANNERS[manner][0], moment), manner)
    assert re.fullmatch(MANNERS[manner][1], outcome.trouble)
    assert len(outcome.solved) == MOMENTS[moment]
    assert outcome.is_lost == (MOMENTS[moment] > 0)
    assert first in ended
    assert all(is_gone(process) for process in ended)
    assert_works(worker, jobs)


def test_an_exception_at_reading_a_job_is_an_answer(worker, jobs):
    outcome = worker.perform(jobs.Dying(MANNERS["raises"][0], "reading"))
    assert outcome.trouble == "SystemError: from within"


@pytest.mark.sample("kill")
@pytest.mark.parametrize("manner", ["leave", "kill", "close", "stop", "rubbish"])
def test_a_death_after_the_last_message_costs_nothing(worker, jobs, manner):
    outcome = outcome_of(worker, jobs.Dying(MANNERS[manner][0], "after the last"), manner)
    assert (outcome.trouble, len(outcome.solved)) == ("", 2)
    assert outcome_of(worker, jobs.Dying("", "never"), manner).trouble == ""


STARTS = {
    "leave": "raise SystemExit(3)",
    "kill": "import os, signal; os.kill(os.getpid(), signal.SIGKILL)",
    "close": "import os, time; os.closerange(0, 99); time.sleep(600)",
    "raises": "import an_engine_that_nobody_has",
    "hang": "import time; time.sleep(600)",
}


LARGE = 2**22  # more than the buffer of a pipe


@pytest.mark.parametrize(
    ("manner", "load"), [*((manner, 0) for manner in STARTS), ("kill", LARGE), ("hang", LARGE)]
)
def test_a_death_before_the_job_is_read_is_a_sentence(jobs, monkeypatch, manner, load):
    monkeypatch.setattr(isolation, "_START", STARTS[manner])
    with closing(WorkerProcess()) as worker:
        outcome = outcome_of(worker, jobs.Dying("", "never", load), manner)
    assert re.fullmatch(MANNERS[manner][1], outcome.trouble)
    assert (outcome.solved, outcome.is_lost) == ([], False)


def assert_gone(path):
    """The worker and its child, whose numbers stand in a file, end soon."""
    deadline = time.monotonic() + 60.0
    processes = [int(word) for word in path.read_text().split()]
    while not all(map(is_gone, processes)) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert len(processes) == 2
    assert all(map(is_gone, processes))


@pytest.mark.sample(without=["close"])
@pytest.mark.parametrize("manner", ["close", "interrupt", "silence"])
def test_nothing_is_left_running_not_even_a_child_of_the_solver(jobs, tmp_path, manner):
    path = tmp_path / "processes"
    worker = WorkerProcess(target_patience=0.3 if manner == "silence" else 60.0)
    if manner == "silence":
        assert "silence" in worker.perform(jobs.WithChild(path)).trouble
    else:
        messages = worker.stream(jobs.WithChild(path))
        assert isinstance(next(messages), Ready)
        if manner == "interrupt":
            with pytest.raises(KeyboardInterrupt):
                messages.throw(KeyboardInterrupt)
        else:
            messages.close()
    assert_gone(path)


@pytest.mark.sample("9")
@pytest.mark.parametrize(
    "end", ["sys.exit(3)", "os.kill(os.getpid(), 15)", "os.kill(os.getpid(), 9)"]
)
def test_a_worker_and_its_child_end_with_the_program_that_started_it(jobs, tmp_path, end):
    script = (
        "import sys; import os; from pathlib import Path\n"
        "from plumbob.bench.measure.isolation import WorkerProcess\n"
        "from dying_jobs import WithChild\n"
        f"next(WorkerProcess().stream(WithChild(sys.argv[1]))); {end}"
    )
    path = tmp_path / "processes"
    command = [sys.executable, "-c", script, str(path)]
    assert subprocess.run(command, cwd=ROOT, check=False).returncode in (3, -15, -9)
    assert_gone(path)


SHADOW = 'open({path!r}, "a").write(__name__); raise SystemExit("the wrong one")'


def test_the_working_directory_is_not_imported_from(jobs, tmp_path, monkeypatch):
    """Nor is another Plumbob on the path."""
    trace = tmp_path / "imported"
    for folder, name in [
        *(("here", name) for name in ("plumbob", "numpy", "multiprocessing", "pickle")),
        ("path", "plumbob"),
    ]:
        (tmp_path / folder / name).mkdir(parents=True)
        (tmp_path / folder / name / "__init__.py").write_text(SHADOW.format(path=str(trace)))
    monkeypatch.chdir(tmp_path / "here")
    path = [str(tmp_path / "path"), os.environ["PYTHONPATH"]]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    with closing(WorkerProcess()) as worker:
        assert_works(worker, jobs)
    assert not trace.exists()
