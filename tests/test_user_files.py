"""Whatever file a user names, reading it ends: one sentence and exit code 2, and little memory."""

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


def plumbob(folder, *words):
    return subprocess.run(
        [sys.executable, "-m", "plumbob", *map(str, words)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )


@pytest.fixture
def folder(tmp_path):
    """A folder with a pipe, a folder, and sparse files of many gigabytes."""
    os.mkfifo(tmp_path / "pipe")
    for name in ("folder", "records", "answers", "greetings"):
        (tmp_path / name).mkdir()
    (tmp_path / "solver.py").write_text(SOLVER)
    (tmp_path / "greetings" / "export.json").write_text("{}")
    sparse = (
        "sparse.json", "sparse.urdf", "sparse.obj", "sparse.py", "records/records.jsonl",
        "answers/export.json", "greetings/greeting.json",
    )  # fmt: skip
    for name in sparse:
        with (tmp_path / name).open("wb") as file:
            file.truncate(SPARSE)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("verify solver.py --rerun /dev/zero", "/dev/zero: expected a regular file"),
        ("verify solver.py --rerun /dev/urandom", "/dev/urandom: expected a regular file"),
        ("verify solver.py --rerun pipe", "pipe: expected a regular file"),
        ("verify solver.py --rerun folder", "folder: expected a regular file"),
        ("verify solver.py --rerun nowhere", "nowhere: there is no such file"),
        ("verify solver.py --rerun sparse.json", "sparse.json: expected at most 268435456 bytes"),
        ("verify --answers answers", "answers/export.json: expected at most 16777216 bytes"),
        ("verify --answers greetings", "greetings/greeting.json: expected at most 16777216 bytes"),
        ("bench ik --list --problem sparse.urdf", "sparse.urdf: expected at most 268435456 bytes"),
        ("bench ik --list --problem sparse.py", "sparse.py: expected at most 268435456 bytes"),
        ("bench cloth --list --problem sparse.obj", "sparse.obj: expected at most 268435456 bytes"),
        ("report records", "records/records.jsonl: expected at most 1073741824 bytes"),
        ("compare records records", "records/records.jsonl: expected at most 1073741824 bytes"),
        ("history records records", "records/records.jsonl: expected at most 1073741824 bytes"),
        ("records list records", "records/records.jsonl: expected at most 1073741824 bytes"),
    ],
)
def test_a_file_without_end_is_refused_in_a_sentence(folder, words, sentence):
    done = plumbob(folder, *words.split())
    assert done.returncode == 2, done.stderr[-500:]
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_model_file_of_many_gigabytes_is_counted_as_not_read(folder):
    done = plumbob(folder, "check", "--files", "sparse.urdf")
    assert done.returncode == 0, done.stderr[-500:]
    assert "Of 1 files nothing disagrees" in done.stdout
