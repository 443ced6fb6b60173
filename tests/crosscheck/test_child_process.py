"""A process of one's own: it answers, stays silent or ends, and takes all its children with it."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from plumbob.crosscheck.child_process import PipedProcess, kill_group

ECHO = (
    "import plumbob.crosscheck.child_process as c; p = c.attach({}); "
    "p.send((p.recv(), None)); p.recv()"
)


@pytest.fixture
def child(request):
    child = PipedProcess(request.param)
    yield child
    child.end()


@pytest.mark.parametrize("child", [ECHO], indirect=True)
def test_a_message_comes_back_and_silence_is_none(child):
    child.send(bytes(2**20))
    assert child.receive(60.0) == (bytes(2**20), None)
    with pytest.raises(TimeoutError):
        child.receive(0.05)


@pytest.mark.parametrize(
    ("child", "how"),
    [("raise SystemExit(3)", "with code 3"), ("import os; os.kill(os.getpid(), 9)", "by SIGKILL")],
    indirect=["child"],
)
def test_a_process_that_ended_sends_nothing_and_its_ending_has_a_name(child, how):
    child.send("anything")
    with pytest.raises(EOFError):
        child.receive(60.0)
    assert child.ending() == how


def test_a_group_is_killed_with_all_that_it_has_started():
    start = "import subprocess as s, time; print(s.Popen(['sleep', '600']).pid); time.sleep(600)"
    process = subprocess.Popen(
        [sys.executable, "-u", "-c", start], stdout=subprocess.PIPE, process_group=0
    )
    with process:
        grandchild = int(process.stdout.readline())
        os.kill(grandchild, 0)
        kill_group(process)
    status = Path(f"/proc/{grandchild}/status")
    deadline = time.monotonic() + 5.0
    while (alive := status.exists() and "State:\tZ" not in status.read_text()) and (
        time.monotonic() < deadline
    ):
        time.sleep(0.01)
    assert not alive
    assert process.returncode is not None
