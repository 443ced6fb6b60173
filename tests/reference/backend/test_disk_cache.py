"""Files of compiled kernels that cannot be used count as absent, and are written anew."""

import os
import shutil
import subprocess
import sys
import textwrap
import threading

import filelock
import pytest
from numba.core import config
from numba.core.errors import TypingError

from plumbob.reference.backend import compiled

CALLER = textwrap.dedent("""
    import numpy as np
    from shapes import Disc
    from plumbob.reference.backend.compiled import Kernel

    def area(disc):
        return 3.0 * disc.radius[0] * disc.radius[0]

    kernel = Kernel(area)
    print(kernel(Disc(np.array([2.0]))), sum(kernel.compiled.stats.cache_hits.values()))
""")
SHAPES = textwrap.dedent("""
    from typing import NamedTuple
    import numpy as np

    class Disc(NamedTuple):
        radius: np.ndarray
""")
CACHED, COMPILED = ["12.0", "1"], ["12.0", "0"]


def run(folder, count=1, **environment):
    """Run callers in a fresh process; return the value and the cache hits that each prints."""
    imports = "; ".join(f"import caller{i}" for i in range(count))
    command, settings = [sys.executable, "-B", "-c", imports], {**os.environ, **environment}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=settings)
    assert done.returncode == 0, done.stderr[-500:]
    return [line.split() for line in done.stdout.splitlines()]


def callers(folder, count):
    """Write modules with a kernel each, in whose cache one compiled version lies."""
    (folder / "shapes.py").write_text(SHAPES)
    for i in range(count):
        (folder / f"caller{i}.py").write_text(CALLER)
    assert run(folder, count) == [COMPILED] * count
    return folder


FAULTS = {
    "cut": lambda content: content[: len(content) // 2],
    "emptied": lambda content: b"",
    "a byte of machine code inverted": lambda content: (
        content[: len(content) // 2]
        + bytes([content[len(content) // 2] ^ 0xFF])
        + content[len(content) // 2 + 1 :]
    ),
    "of another kind": lambda content: b"no pickle",
}
DAMAGES = [(fault, kind) for fault in FAULTS for kind in ("nbi", "nbc")]


@pytest.mark.slow
def test_damaged_files_are_compiled_anew_and_whole_ones_used(tmp_path):
    """One caller for each damage, and one left whole."""
    count = len(DAMAGES) + 1
    folder = callers(tmp_path, count)
    for i, (fault, kind) in enumerate(DAMAGES):
        (file,) = folder.rglob(f"caller{i}.*.{kind}")
        file.write_bytes(FAULTS[fault](file.read_bytes()))
    assert run(folder, count) == [COMPILED] * len(DAMAGES) + [CACHED]
    assert run(folder, count) == [CACHED] * count


@pytest.mark.slow
def test_a_cache_that_names_a_class_that_has_moved_is_renewed(tmp_path):
    """Numba pickles the types of arguments into its index."""
    folder = callers(tmp_path, 1)
    (folder / "shapes.py").rename(folder / "figures.py")
    (folder / "shapes.py").write_text("")
    (folder / "caller0.py").write_text(CALLER.replace("from shapes", "from figures"))
    assert run(folder) == [COMPILED]
    assert run(folder) == [CACHED]


@pytest.mark.slow
def test_a_kernel_runs_where_nothing_can_be_saved(tmp_path):
    """Files stand where numba would make a folder."""
    folder = callers(tmp_path, 1)
    shutil.rmtree(folder / "__pycache__")
    for name in ("__pycache__", "home"):
        (folder / name).write_text("")
    home = str(folder / "home")
    assert run(folder, HOME=home, XDG_CACHE_HOME=home) == [COMPILED]


def doubled(x):
    return 2.0 * x


def kernel_of_another_process():
    """Return a kernel that knows of no version but those on disk."""
    return compiled.compile_kernel.__wrapped__(doubled)


@pytest.fixture
def index(tmp_path, monkeypatch):
    """The index of the only kernel in the cache."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    kernel_of_another_process()(2.0)
    return next(tmp_path.rglob("*.nbi"))


def test_a_kernel_that_another_process_compiles_is_waited_for(index):
    """This test is the other process: it has the lock, and brings the file before it lets go."""
    away = index.rename(index.with_suffix(".away"))
    kernel = kernel_of_another_process()
    thread = threading.Thread(target=kernel, args=[2.0])
    with filelock.FileLock(f"{index}.lock"):
        thread.start()
        thread.join(0.3)  # in which a kernel that does not wait is compiled
        away.rename(index)
    thread.join()
    assert [*kernel.stats.cache_hits.values()] == [1]


def test_nobody_waits_for_a_kernel_that_cannot_be_compiled(index):
    with pytest.raises(TypingError):
        kernel_of_another_process()("text")
    filelock.FileLock(f"{index}.lock").acquire(timeout=0.0)
