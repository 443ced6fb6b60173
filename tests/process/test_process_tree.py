"""Laws of finding, measuring and ending what a program has started."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from hostile_programs import case, program, running

from plumbob.process import tree as process_tree
from plumbob.process.child import ChildProcess, Loss, LostError, python_process
from plumbob.process.tree import carry, end_group, family

ROOT = str(Path(__file__).parents[2])
MARKER = (1 << 61) - 1234567
# Starts a child in its session, one in another, and one that nothing but its marker betrays; says
# so when each is where it stays.
BROOD = """
import os, time
settled, settle = os.pipe()
if os.fork():
    if os.fork():
        if os.fork():
            for _ in range(3):
                os.read(settled, 1)
            print("ready", flush=True); time.sleep(99)
        os.setsid()
        parent = os.getpid()
        if os.fork():
            os._exit(0)
        while os.getppid() == parent:
            time.sleep(0.001)
    else:
        os.setsid()
else:
    kept = b"x" * (40 << 20)
os.write(settle, b"."); time.sleep(99)
"""


@pytest.fixture(params=[MARKER, 0], ids=["marked", "unmarked"])
def marker(request):
    if request.param and process_tree.LIMIT is None:
        pytest.skip("Linux has this limit only")
    return request.param


@pytest.fixture
def brood(tmp_path):
    file = tmp_path / "brood.py"
    file.write_text(BROOD)
    process = subprocess.Popen(
        [sys.executable, "-I", "-S", str(file)],
        stdout=subprocess.PIPE,
        preexec_fn=partial(carry, MARKER),
        start_new_session=True,
    )
    process.stdout.readline()
    yield process
    end_group(process.pid, MARKER)
    process.communicate()
    assert not running(tmp_path)


def wait_for(condition):
    """Wait until a condition has held once; a busy machine may take long to get there."""
    deadline = time.monotonic() + 60.0
    while not (holds := condition()) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert holds


def test_a_family_is_group_descendants_and_what_carries_the_marker(brood, marker):
    wait_for(lambda: len(family(brood.pid, marker)) == (4 if marker else 3))
    assert len(family(brood.pid, MARKER - 1)) == 3
    assert os.getpid() not in [process.pid for process in family(brood.pid, marker)]


def test_memory_is_measured(brood):
    wait_for(lambda: max(process.memory for process in family(brood.pid)) > 40 << 20)
    assert all(process.memory < 80 << 20 for process in family(brood.pid))


def test_a_group_is_ended_and_with_a_marker_all_that_can_be_found(brood, marker):
    wait_for(lambda: len(family(brood.pid, MARKER)) == 4)
    end_group(brood.pid, marker)
    assert brood.wait() == -signal.SIGKILL
    wait_for(lambda: len(family(brood.pid, MARKER)) == (0 if marker else 2))


def test_what_has_ended_is_in_no_family():
    process = subprocess.Popen(["sleep", "99"], start_new_session=True)
    process.kill()
    wait_for(lambda: family(process.pid) == [])
    end_group(process.pid)
    assert process.wait() == -signal.SIGKILL


def test_what_forks_and_ends_on_and_on_is_caught_at_once(tmp_path, monkeypatch):
    """No list of processes is true for as long as it takes to read it."""
    monkeypatch.setattr(process_tree, "ROUNDS", 1)
    code = (
        "import os, time\nprint(flush=True)\nend = time.time() + 5\n"
        "while time.time() < end:\n    if os.fork(): os._exit(0)"
    )
    command = [sys.executable, "-I", "-S", "-c", code, f"{tmp_path}/"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)
    process.stdout.readline()
    end_group(process.pid)
    assert not running(tmp_path)
    process.communicate()


@pytest.mark.parametrize("columns", ["40", None])
def test_what_runs_is_seen(tmp_path, monkeypatch, columns):
    """Otherwise no test would see what is left running."""
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    connection = program(tmp_path, "pass")
    connection.answer(case(2))
    assert len(running(tmp_path, 0.0)) == 1
    connection.close()
    assert not running(tmp_path)


@pytest.mark.sample("9")
@pytest.mark.parametrize(
    "end", ["os._exit(0)", "os.kill(os.getpid(), 9)", "os.kill(os.getpid(), 15)"]
)
def test_a_judge_that_is_killed_takes_the_program_with_it(tmp_path, end):
    """Even one that ignores the end of its input and hangs."""
    program(tmp_path, "while True: tick()")
    judge = (
        "import os, sys; sys.path[:0] = sys.argv[1:3]\n"
        "from hostile_programs import LIMITS, case, program\n"
        "from plumbob.verify.connections.program import ProgramConnection\n"
        "connection = ProgramConnection([sys.executable, '-I', '-S', sys.argv[3]], limits=LIMITS)\n"
        "connection.answer(case(2))\n"
        'connection._ready().send(b\'{"id": 2, "parents": [1, 2, 3]}\\n\')\n'
        f"connection._ready()._exchange(0.1)\n{end}\n"
    )
    command = [sys.executable, "-c", judge, ROOT, f"{ROOT}/tests", str(tmp_path / "connection.py")]
    assert subprocess.run(command, check=False).returncode in (0, -9, -15)
    assert not running(tmp_path)


def test_each_program_has_one_guard_and_it_leaves(tmp_path):
    connection = program(tmp_path, "pass")
    connection.answer(case(2))
    pid, marker = connection._process.pid, connection._process._marker

    def guards():
        listed = subprocess.run(["ps", "-A", "-ww", "-o", "args="], capture_output=True, check=True)
        lines = listed.stdout.decode().splitlines()
        return sum("read line ||" in line and line.endswith(f" {pid} {marker}") for line in lines)

    assert guards() == 1
    connection.close()
    assert guards() == 0


def loss(child, **limits):
    with pytest.raises(LostError) as caught:
        child.receive(60.0, **limits)
    return caught.value.loss


def test_processor_time_of_all_that_it_starts_is_limited():
    spin = "import os\nos.fork()\nwhile True: pass"
    child = ChildProcess([sys.executable, "-c", spin], memory=1 << 40)
    assert loss(child, processor=0.5) is Loss.PROCESSOR
    child.end()


def test_a_signal_without_a_name_is_a_number():
    child = python_process("import os; os.kill(os.getpid(), 40)")
    assert loss(child) is Loss.ENDED
    assert child.ending == "by signal 40"
