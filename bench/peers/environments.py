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


def version(name: str, package: str) -> str:
    """Return the version of a package in a peer's environment, "" if it is not there."""
    places = [str(path) for path in _folder(name).glob("lib/python*/site-packages")]
    found = importlib.metadata.distributions(name=package, path=places)
    return next((distribution.version for distribution in found), "")


def _folder(name: str) -> Path:
    return Path(sys.prefix) / "peers" / name
