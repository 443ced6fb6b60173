"""Environments of peers whose requirements contradict ours, a folder each.

`make peers` makes them as `peers/NAME` below the environment that runs the bench. Such a peer works
in a process of that environment's Python.
"""

import importlib.metadata
import sys
from pathlib import Path


def python(name: str) -> Path:
    """Return where the Python of a peer's environment is, or would be."""
    return _folder(name) / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")


def distribution(name: str, package: str) -> importlib.metadata.Distribution | None:
    """Return a package in a peer's environment, or in ours if its name is "", None if it lacks."""
    places = [str(path) for path in _folder(name).glob("lib/python*/site-packages")]
    found = importlib.metadata.distributions(name=package, path=places if name else sys.path)
    return next(iter(found), None)


def _folder(name: str) -> Path:
    return Path(sys.prefix) / "peers" / name
