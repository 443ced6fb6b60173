"""What a solver starts is ended with it, also what leaves its session and its environment."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from hostile_programs import case, program, running

from plumbob.process import tree as process_tree
from plumbob.verify.connections import open_connection
from plumbob.verify.exchange import Answer

ROOT = Path(__file__).parents[2]
LINUX_ONLY = pytest.mark.skipif(process_tree.LIMIT is None, reason="Linux has this limit only")
# Forks twice, leaves the session, and runs something else without an environment.
DAEMON = """
import os
def start_daemon():
    if os.fork():
        os.wait()
        return
    os.setsid()
    if os.fork():
        os._exit(0)
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    os.execve("/bin/sleep", [{name!r}, "99"], {{}})
"""
SMALL = "--quick --targets 2 --problem chain/near --solver solver.py"
LEFT = "It left processes running that it had started (1); they were ended."
SOLVER = "start_daemon()\ndef ccd(offsets, target): return offsets\n"


def daemon(folder):
    return DAEMON.format(name=f"{folder}/daemon")


@LINUX_ONLY
@pytest.mark.parametrize(
    ("then", "words", "remarks"),
    [("while True: right(read())", None, [LEFT]), ("read()\nos.abort()", "aborted", [])],
)
def test_a_daemon_of_a_program_is_ended_and_remarked(tmp_path, then, words, remarks):
    loop = f"{daemon(tmp_path)}\nstart_daemon()\ngreet()\n{then}"
    connection = program(tmp_path, "pass", loop=loop)
    assert connection.greeting
    deadline = time.monotonic() + 20.0
    while not any("/daemon " in line for line in running(tmp_path, 0.0)):
        assert time.monotonic() < deadline
    answer = connection.answer(case(2))
    assert words is None or words in str(answer.sentence)
    connection.close()
    assert [str(remark) for remark in connection.remarks] == remarks
    assert not running(tmp_path)


@LINUX_ONLY
def test_the_memory_of_a_daemon_counts(tmp_path):
    """As much as all may take, in a process that is no descendant any more."""
    loop = (
        f"{daemon(tmp_path)}\nif os.fork() == 0:\n    os.setsid()\n"
        "    if os.fork(): os._exit(0)\n    held = b'x' * (300 << 20)\n"
        "    while True: tick()\nos.wait()\ngreet()\nwhile True: tick()"
    )
    connection = program(tmp_path, "pass", loop=loop)
    assert "took more than 0.262 GB of memory" in str(connection.answer(case(2)).sentence)
    assert not running(tmp_path)


@pytest.mark.slow
@LINUX_ONLY
@pytest.mark.parametrize(
    "words",
    [
        "verify {file}",
        "verify -- {python} {program}",
        f"bench ik {SMALL} --with {{file}} -o {{out}}",
    ],
)
def test_no_command_leaves_a_daemon(tmp_path, words):
    file, speaker = tmp_path / "solver.py", tmp_path / "speaker.py"
    file.write_text(daemon(tmp_path) + SOLVER)
    speaker.write_text(
        f"{daemon(tmp_path)}\nstart_daemon()\nimport json, sys\n"
        "print(json.dumps({'id': json.loads(input())['id'], 'protocol': 1, 'tasks': ['energy']}),"
        " flush=True)\nfor line in sys.stdin:\n"
        "    print(json.dumps({'id': json.loads(line)['id'], 'total': 1.0}), flush=True)\n"
    )
    arguments = words.format(
        file=file, python=sys.executable, program=speaker, out=tmp_path / "out"
    )
    done = subprocess.run(
        [sys.executable, "-m", "plumbob", *arguments.split()],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode in (0, 1), done.stderr[-500:]
    assert LEFT in done.stdout or words.startswith("bench")
    assert not running(tmp_path)


def test_what_the_caller_started_is_left_alone(tmp_path):
    """Children, and daemons, started before the solver, beside it by a thread, and after it."""
    own, stop = [], threading.Event()
    (tmp_path / "solver.py").write_text("def forward_kinematics(offsets): return offsets\n")
    code = f"{DAEMON.format(name='a daemon of the caller')}\nstart_daemon()"

    def start():
        own.append(subprocess.Popen(["sleep", "99"]))
        subprocess.run([sys.executable, "-I", "-S", "-c", code], check=True)

    def start_on_and_on():
        while not stop.wait(0.2):
            start()

    def daemons():
        listed = subprocess.run(["ps", "-A", "-o", "pid=,args="], capture_output=True, text=True)
        return [one.split()[0] for one in listed.stdout.splitlines() if "of the caller" in one]

    thread = threading.Thread(target=start_on_and_on)
    thread.start()
    try:
        for _ in range(2):
            connection = open_connection(tmp_path / "solver.py")
            assert isinstance(connection.answer(case(2)), Answer)
            connection.close()
            assert connection.remarks == ()
        stop.set()
        thread.join()
        start()
        assert all(one.poll() is None for one in own)
        assert len(daemons()) == len(own)
    finally:
        stop.set()
        thread.join()
        for one in own:
            one.kill()
            one.wait()
        subprocess.run(["kill", *daemons()], check=False)
