"""Laws of finding, measuring and ending what a program has started."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hostile_programs import case, program, running

from plumbob.crosscheck.verify.solvers import processes
from plumbob.crosscheck.verify.solvers.processes import MARKER, end_group, family

ROOT = str(Path(__file__).parents[3])
# Starts a child in its session, one in another, and one that nothing but its environment betrays.
BROOD = """
import os, sys, time
if os.fork():
    if os.fork():
        if os.fork():
            print("ready", flush=True); time.sleep(99)
        os.setsid()
        if os.fork():
            os._exit(0)
        time.sleep(99)
    os.setsid(); time.sleep(99)
kept = b"x" * (40 << 20); time.sleep(99)
"""


@pytest.fixture
def brood(tmp_path):
    file = tmp_path / "brood.py"
    file.write_text(BROOD)
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", str(file)],
        stdout=subprocess.PIPE,
        env=os.environ | {MARKER: "1234567"},
        start_new_session=True,
    )
    process.stdout.readline()
    yield process
    end_group(process.pid, 1234567)
    process.communicate()
    assert not running(tmp_path)


@pytest.fixture(params=["proc", "ps"])
def source(request, monkeypatch):
    """Where processes are read from."""
    if request.param == "ps":
        monkeypatch.setattr(processes, "HAS_PROC", False)
    elif not processes.HAS_PROC:
        return "ps"
    return request.param


def wait_for(condition, seconds=5.0):
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert condition()


def test_a_family_is_group_descendants_and_what_carries_the_marker(brood, source, tmp_path):
    wait_for(lambda: len(family(brood.pid)) == 3)
    if source == "proc":
        wait_for(lambda: len(family(brood.pid, 1234567)) == 4)
    assert len(family(brood.pid, 7654321)) == 3
    assert os.getpid() not in [one.pid for one in family(brood.pid, 1234567)]


def test_memory_is_measured(brood, source):
    wait_for(lambda: max(one.memory for one in family(brood.pid)) > 40 << 20)
    assert all(one.memory < 80 << 20 for one in family(brood.pid))


def test_a_group_is_ended_with_all_that_can_be_found(brood, source, tmp_path):
    wait_for(lambda: len(family(brood.pid)) == 3)
    end_group(brood.pid, 1234567)
    assert family(brood.pid) == []
    assert brood.wait() == -signal.SIGKILL


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("0:00.05", 0.05), ("00:00:07", 7.0), ("01:02:03", 3723.0), ("2-01:00:00", 176400.0)],
)
def test_times_of_ps_are_read(text, seconds):
    assert processes._seconds(text) == seconds


def test_what_has_ended_is_in_no_family(source):
    process = subprocess.Popen(["sleep", "99"], start_new_session=True)
    process.kill()
    wait_for(lambda: family(process.pid) == [])
    end_group(process.pid)
    assert process.wait() == -signal.SIGKILL


def test_what_forks_and_ends_on_and_on_is_caught_at_once(tmp_path, monkeypatch):
    """No list of processes is true for as long as it takes to read it."""
    monkeypatch.setattr(processes, "ROUNDS", 1)
    code = (
        "import os, time\nprint(flush=True)\nend = time.time() + 5\n"
        "while time.time() < end:\n    if os.fork(): os._exit(0)"
    )
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", code, f"{tmp_path}/"],
        stdout=subprocess.PIPE,
        start_new_session=True,
    )
    process.stdout.readline()
    end_group(process.pid)
    assert not running(tmp_path)
    process.communicate()


@pytest.mark.parametrize("columns", ["40", None])
def test_what_runs_is_seen(tmp_path, monkeypatch, columns):
    """Otherwise no test would see what is left running."""
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    contestant = program(tmp_path, "pass")
    contestant.answer(case(2))
    assert len(running(tmp_path, 0.0)) == 1
    contestant.close()
    assert not running(tmp_path)


@pytest.mark.parametrize(
    "end", ["os._exit(0)", "os.kill(os.getpid(), 9)", "os.kill(os.getpid(), 15)"]
)
def test_a_judge_that_is_killed_takes_the_program_with_it(tmp_path, end):
    """Even one that ignores the end of its input and hangs."""
    program(tmp_path, "while True: tick()")
    judge = (
        "import os, sys; sys.path[:0] = sys.argv[1:3]\n"
        "from hostile_programs import LIMITS, case, program\n"
        "from plumbob.crosscheck.verify.solvers.program import ProgramContestant\n"
        "contestant = ProgramContestant([sys.executable, '-I', '-S', sys.argv[3]], limits=LIMITS)\n"
        "contestant.answer(case(2))\n"
        'contestant._ready().send(b\'{"id": 2, "parents": [1, 2, 3]}\\n\')\n'
        f"contestant._ready()._exchange(0.1)\n{end}\n"
    )
    command = [sys.executable, "-c", judge, ROOT, f"{ROOT}/tests", str(tmp_path / "contestant.py")]
    assert subprocess.run(command, check=False).returncode in (0, -9, -15)
    assert not running(tmp_path)


def test_each_contestant_has_one_guard_and_it_leaves(tmp_path):
    contestant = program(tmp_path, "pass")
    contestant.answer(case(2))
    pid, marker = contestant._process._process.pid, contestant._process._marker

    def guards():
        listed = subprocess.run(["ps", "-A", "-ww", "-o", "args="], capture_output=True, check=True)
        lines = listed.stdout.decode().splitlines()
        return sum("read line ||" in one and one.endswith(f" sh {pid} {marker}") for one in lines)

    assert guards() == 1
    contestant.close()
    assert guards() == 0
