"""Reading what others wrote takes time in proportion to its size, whatever it holds."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
# Where time grows with the square of the size, a megabyte takes hours. Linear readers take a
# hundredth of this, imports included [s of a processor].
LIMIT = 10
# Each text is a piece of so many bytes, repeated between a beginning and an end.
SIZE = 1 << 20

MESSAGE = "from plumbob.crosscheck.verify.message import decode_object as read"
TABLE = """
from plumbob.crosscheck.verify.solvers.tables import read_table
from plumbob.crosscheck.verify.task import TASKS
read = lambda text: read_table(TASKS["resample"].outputs[0], {}, text)
"""
MODEL = """
import pathlib, tempfile
from plumbob.crosscheck.engines.file_kind import file_kind
def read(text):
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "model.xml").write_bytes(text)
        file_kind(pathlib.Path(folder, "model.xml"))
"""
MOTION = """
from plumbob.crosscheck.robots.independent_bvh import global_poses
read = lambda text: next(global_poses(text.decode()))
"""
RECORD = "from plumbob.bench.harness.record import decode as read"
TEXTS = {
    "message: escaped quotes": (MESSAGE, b'{"id": 1, "a": "', rb"\"", b""),
    "message: quotes": (MESSAGE, b'{"id": 1, "a": [nan', b'"', b""),
    "message: backslashes": (MESSAGE, b'{"id": 1, "a": "', b"\\", b""),
    "message: backslashes at ends of lines": (MESSAGE, b'{"id": 1, "a": "', b'"\\\n', b""),
    "message: strings and a word": (MESSAGE, b'{"id": 1, "a": [', b'"",', b"nan]}"),
    "message: words": (MESSAGE, b'{"id": 1, "a": [', b"nan(", b"]}"),
    "message: a long word": (MESSAGE, b'{"id": 1, "a": [nan(', b"a", b"]}"),
    "message: digits": (MESSAGE, b'{"id": 1, "a": [nan, ', b"9", b"]}"),
    "message: decimals": (MESSAGE, b'{"id": 1, "a": [nan, 1.', b"9", b"]}"),
    "message: beginnings of objects": (MESSAGE, b"print ", b"{ ", b""),
    "message: spaces": (MESSAGE, b'{"id": 1, "a": [nan', b" ", b"]"),
    "table: cells": (TABLE, b"", b";,\t ", b"a"),
    "table: a word": (TABLE, b"nan(", b"a", b""),
    "table: digits": (TABLE, b"1.", b"1", b",a,3"),
    "table: lines": (TABLE, b"", b"\n", b"a"),
    "model: spaces": (MODEL, b"", b" ", b""),
    "model: comments": (MODEL, b"", b"<!-- -->", b""),
    "model: comments without end": (MODEL, b"", b"<!--", b""),
    "model: declarations without end": (MODEL, b"", b"<? ?><?", b""),
    "motion: empty lines": (MOTION, b"HIERARCHY", b"\n", b""),
    "motion: spaces": (MOTION, b"MOTION\nFrames: ", b" ", b"1"),
    "record: quotes": (RECORD, b'{"format": 3, "suite": "', rb"\"", b""),
    "record: spaces": (RECORD, b'{"format": 3, "suite":', b" ", b""),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_reader_takes_time_in_proportion_to_the_size_of_a_text(name):
    reader, *parts = TEXTS[name]
    program = f"""
import sys; sys.path.insert(0, sys.argv[1])
{reader}
beginning, piece, end = {parts!r}
try:
    read(beginning + piece * ({SIZE} // len(piece)) + end)
except (AssertionError, IndexError, ValueError):
    pass
"""
    done = subprocess.run(
        [sys.executable, "-c", program, str(ROOT)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-500:] or f"more than {LIMIT} s of a processor"
