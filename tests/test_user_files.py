"""Whatever file a user names, reading it ends: one sentence and exit code 2, and little memory."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# A pipe that nobody writes into blocks for ever; a busy machine starts Python in far less [s].
PATIENCE = 120
# Less than the sparse files hold, and more than Python and its packages reserve [B].
MEMORY = 6 << 30
SPARSE = 12 << 30
SOLVER = "def energy(masses): return {'total': 1.0}\n"


# Runs command lines one after the other; the last one begun is known where one ends the process.
PROGRAM = """
import contextlib, io, json, sys
from plumbob.cli.main import run_command
done = {}
for line in json.loads(sys.argv[1]):
    print(line, file=sys.stderr, flush=True)
    with contextlib.redirect_stdout(io.StringIO()) as out:
        with contextlib.redirect_stderr(io.StringIO()) as err:
            code = run_command(line.split())
    done[line] = code, out.getvalue(), err.getvalue()
print(json.dumps(done))
"""
REFUSED = {
    "verify solver.py --rerun pipe": "pipe: expected a regular file",
    "verify solver.py --rerun sparse.json": "sparse.json: expected at most 268435456 bytes",
    "verify --answers answers": "answers/export.json: expected at most 16777216 bytes",
    "verify --answers greetings": "greetings/greeting.json: expected at most 16777216 bytes",
    "bench ik --list --problem sparse.urdf": "sparse.urdf: expected at most 268435456 bytes",
    "bench ik --list --problem sparse.py": "sparse.py: expected at most 268435456 bytes",
} | {
    f"{command} records": "records/records.jsonl: expected at most 1073741824 bytes"
    for command in ("report", "compare records")
}
COUNTED = "check --files sparse.urdf"


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Exit code, output and complaint of each command line, by a process of little memory.

    Its folder holds a pipe, and sparse files of many gigabytes.
    """
    tmp_path = tmp_path_factory.mktemp("files")
    os.mkfifo(tmp_path / "pipe")
    for name in ("records", "answers", "greetings"):
        (tmp_path / name).mkdir()
    (tmp_path / "solver.py").write_text(SOLVER)
    (tmp_path / "greetings" / "export.json").write_text("{}")
    sparse = (
        "sparse.json", "sparse.urdf", "sparse.py", "records/records.jsonl",
        "answers/export.json", "greetings/greeting.json",
    )  # fmt: skip
    for name in sparse:
        with (tmp_path / name).open("wb") as file:
            file.truncate(SPARSE)
    lines = json.dumps([*REFUSED, COUNTED])
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, lines], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
        check=False, timeout=PATIENCE,
    )  # fmt: skip
    assert process.returncode == 0, process.stderr[-500:]
    return json.loads(process.stdout)


@pytest.mark.parametrize("line", REFUSED)
def test_a_file_without_end_is_refused_in_a_sentence(done, line):
    code, _, complaint = done[line]
    assert code == 2
    assert REFUSED[line] in complaint
    assert complaint.count("\n") == 1


def test_a_model_file_of_many_gigabytes_is_counted_as_not_read(done):
    code, output, _ = done[COUNTED]
    assert code == 0
    assert "In 1 file no reading disagrees" in output
