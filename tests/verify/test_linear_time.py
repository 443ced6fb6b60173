"""Reading what others wrote takes time in proportion to its size, whatever it holds."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Where time grows with the square of the size, a megabyte takes hours. Linear readers take a
# hundredth of this, imports included [s of a processor].
LIMIT = 10
# Each text is a piece of so many bytes, repeated between a beginning and an end.
SIZE = 1 << 20

READERS = {
    "message": "from plumbob.verify.message import decode_object as read",
    "model": """
import pathlib, tempfile
from plumbob.crosscheck.engines.file_kind import file_kind
def read(text):
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "model.xml").write_bytes(text)
        file_kind(pathlib.Path(folder, "model.xml"))
""",
    "motion": """
from plumbob.crosscheck.robots.independent_bvh import global_poses
read = lambda text: next(global_poses(text.decode()))
""",
    "record": "from plumbob.bench.measure.record import decode as read",
}
TEXTS = {
    "message": {
        "escaped quotes": (b'{"id": 1, "a": "', rb"\"", b""),
        "quotes": (b'{"id": 1, "a": [nan', b'"', b""),
        "backslashes": (b'{"id": 1, "a": "', b"\\", b""),
        "backslashes at ends of lines": (b'{"id": 1, "a": "', b'"\\\n', b""),
        "strings and a word": (b'{"id": 1, "a": [', b'"",', b"nan]}"),
        "words": (b'{"id": 1, "a": [', b"nan(", b"]}"),
        "a long word": (b'{"id": 1, "a": [nan(', b"a", b"]}"),
        "digits": (b'{"id": 1, "a": [nan, ', b"9", b"]}"),
        "decimals": (b'{"id": 1, "a": [nan, 1.', b"9", b"]}"),
        "beginnings of objects": (b"print ", b"{ ", b""),
        "spaces": (b'{"id": 1, "a": [nan', b" ", b"]"),
    },
    "model": {
        "spaces": (b"", b" ", b""),
        "comments": (b"", b"<!-- -->", b""),
        "comments without end": (b"", b"<!--", b""),
        "declarations without end": (b"", b"<? ?><?", b""),
    },
    "motion": {
        "empty lines": (b"HIERARCHY", b"\n", b""),
        "spaces": (b"MOTION\nFrames: ", b" ", b"1"),
    },
    "record": {
        "quotes": (b'{"format": 3, "suite": "', rb"\"", b""),
        "spaces": (b'{"format": 3, "suite":', b" ", b""),
    },
}


@pytest.mark.sample("message", "record")
@pytest.mark.parametrize("reader", READERS)
def test_a_reader_takes_time_in_proportion_to_the_size_of_a_text(reader):
    program = f"""
import sys; sys.path.insert(0, sys.argv[1])
{READERS[reader]}
for name, (beginning, piece, end) in {TEXTS[reader]!r}.items():
    print(name, flush=True)
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
    late = f"more than {LIMIT} s of a processor, at last in {done.stdout.splitlines()[-1:]}"
    assert done.returncode == 0, done.stderr[-500:] or late
