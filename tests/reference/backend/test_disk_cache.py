"""Files of compiled kernels that cannot be used count as absent, and are written anew."""

import os
import shutil
import subprocess
import sys
import textwrap

import pytest

CALLER = textwrap.dedent("""
    import numpy as np
    from shapes import Disc
    from plumbob.reference.backend.compiled import Kernel

    def area(disc):
        return 3.0 * disc.radius[0] * disc.radius[0]

    run = Kernel(area)
    print(run(Disc(np.array([2.0]))), sum(run.compiled.stats.cache_hits.values()))
""")
SHAPES = textwrap.dedent("""
    from typing import NamedTuple
    import numpy as np

    class Disc(NamedTuple):
        radius: np.ndarray
""")
CACHED, COMPILED = ["12.0", "1"], ["12.0", "0"]


def run(folder, **environment):
    """What a fresh process prints: the kernel's value, and how often it came from the cache."""
    command = [sys.executable, "-B", "caller.py"]
    settings = {**os.environ, **environment}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=settings)
    assert done.returncode == 0, done.stderr[-500:]
    return done.stdout.split()


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """A folder of a kernel in whose cache one compiled version lies."""
    folder = tmp_path_factory.mktemp("original")
    (folder / "caller.py").write_text(CALLER)
    (folder / "shapes.py").write_text(SHAPES)
    assert run(folder) == COMPILED
    return folder


@pytest.fixture
def folder(original, tmp_path):
    """A copy of that folder."""
    return shutil.copytree(original, tmp_path / "copy")


def test_a_cache_that_is_whole_is_used(folder):
    assert run(folder) == CACHED


def cut(content):
    return content[: len(content) // 2]


def emptied(content):
    return b""


def overwritten(content):
    """Flip the bits of a byte in the middle: of machine code, in a data file."""
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :]


def of_another_kind(content):
    return b"no pickle"


@pytest.mark.parametrize("fault", [cut, emptied, overwritten, of_another_kind])
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_damaged_cache_is_renewed(folder, kind, fault):
    (file,) = folder.rglob(f"*.{kind}")
    file.write_bytes(fault(file.read_bytes()))
    assert run(folder) == COMPILED
    assert run(folder) == CACHED


def test_a_cache_that_names_a_class_that_has_moved_is_renewed(folder):
    """As numba pickles the types of arguments into its index."""
    (folder / "figures.py").write_text(SHAPES)
    (folder / "shapes.py").write_text("")
    (folder / "caller.py").write_text(CALLER.replace("from shapes", "from figures"))
    assert run(folder) == COMPILED
    assert run(folder) == CACHED


def test_a_kernel_runs_where_nothing_can_be_saved(folder):
    """Files stand where numba would make a folder."""
    shutil.rmtree(folder / "__pycache__")
    for name in ("__pycache__", "home"):
        (folder / name).write_text("")
    home = str(folder / "home")
    assert run(folder, HOME=home, XDG_CACHE_HOME=home) == COMPILED
