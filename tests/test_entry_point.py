"""Where the command line begins: Ctrl-C at any moment, and standard streams that are closed."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]["plumbob"]
MODULE, FUNCTION = SCRIPT.split(":")
# What the script does that pip installs, and the other way to the command line.
DOORS = {
    "script": ["-c", f"import sys; from {MODULE} import {FUNCTION}; sys.exit({FUNCTION}())"],
    "module": ["-m", "plumbob"],
}
STRIKE = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n"
# A C extension says so where its start is interrupted.
AS_IN_C = (
    STRIKE.replace("\nos", "\ntry:\n    os") + "except BaseException:\n    raise ImportError\n"
)
AT_EXIT = "import atexit, os, signal\natexit.register(os.kill, os.getpid(), signal.SIGINT)\n"
INTERRUPTION = "plumbob: interrupted\n"


def run(arguments, folder, **options):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (folder, ROOT)))}
    command = [sys.executable, *arguments]
    options = {"stderr": subprocess.PIPE, "stdout": subprocess.PIPE, **options}
    return subprocess.run(command, cwd=folder, env=environment, text=True, check=False, **options)


@pytest.mark.sample(without=["script-numpy", "script-typer"])
@pytest.mark.parametrize(
    ("door", "module", "source", "arguments"),
    [
        ("script", "numpy", STRIKE, ["check", "--list"]),
        ("script", "typer", STRIKE, ["--version"]),
        ("module", "typer", STRIKE, ["--version"]),
        ("script", "mujoco", STRIKE, ["check", "spring forces"]),
        ("module", "mujoco", AS_IN_C, ["check", "spring forces"]),
        ("script", "sitecustomize", AT_EXIT, ["--version"]),
    ],
)
def test_ctrl_c_while_modules_are_imported_exits_130(tmp_path, door, module, source, arguments):
    (tmp_path / f"{module}.py").write_text(source)
    done = run([*DOORS[door], *arguments], tmp_path)
    assert (done.returncode, done.stderr) == (130, INTERRUPTION)


def test_ctrl_c_stays_ignored_where_it_was(tmp_path):
    (tmp_path / "typer.py").write_text(STRIKE + "raise SystemExit(7)")
    ignoring = f"import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n{DOORS['script'][1]}"
    assert run(["-c", ignoring], tmp_path).returncode == 7


def test_the_library_leaves_ctrl_c_as_it_is(tmp_path):
    code = "import signal, plumbob; print(signal.getsignal(2) is signal.default_int_handler)"
    assert run(["-c", code], tmp_path).stdout == "True\n"


CLOSED = {"stdin": [0], "stdout": [1], "stderr": [2], "both": [1, 2], "all": [0, 1, 2]}


@pytest.mark.sample("arguments0-2-stdout", "arguments0-2-all", "arguments1-0-stderr")
@pytest.mark.parametrize("closed", CLOSED.values(), ids=CLOSED)
@pytest.mark.parametrize(("arguments", "code"), [(["chek"], 2), (["check", "--list"], 0)])
def test_a_closed_stream_costs_what_is_printed_there(tmp_path, closed, arguments, code):
    def close():
        for number in closed:
            os.close(number)

    done = run([*DOORS["script"], *arguments], tmp_path, preexec_fn=close)
    assert done.returncode == code
    assert bool(done.stderr) == (code == 2 and 2 not in closed)
    assert bool(done.stdout) == (code == 0 and 1 not in closed)


def test_a_file_does_not_take_the_place_of_a_closed_stream(tmp_path):
    """Else what a library prints to file 1 would stand among the records."""
    write = "file = open('file', 'w'); print(file.fileno(), file=file)"
    code = f"from {MODULE} import open_closed_streams; open_closed_streams(); {write}"
    run(["-c", code], tmp_path, preexec_fn=lambda: os.closerange(0, 3))
    assert int((tmp_path / "file").read_text()) > 2


@pytest.mark.parametrize("arguments", [["--version"], ["chek"]])
def test_a_full_disk_behind_both_streams_leaves_the_exit_code(tmp_path, arguments):
    with Path("/dev/full").open("w") as full:
        done = run([*DOORS["script"], *arguments], tmp_path, stdout=full, stderr=full)
    assert done.returncode == 2
