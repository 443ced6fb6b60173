"""Environments of peers with requirements that contradict ours, a folder each.

`make peers` makes them as `peers/NAME` below the environment that runs the bench. Their peers work
in a process of that environment's Python.
"""

import importlib.metadata
import sys
from pathlib import Path


def python(name: str) -> Path:
    """Return the path of the Python of a peer's environment, which need not exist."""
    place = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    return Path(sys.prefix, "peers", name, place)


def distribution(name: str, package: str) -> importlib.metadata.Distribution | None:
    """Return a package in a peer's environment, or in ours if its name is "", None if it lacks."""
    path = map(str, Path(sys.prefix, "peers", name).glob("lib/python*/site-packages"))
    places = list(path) if name else sys.path
    return next(iter(importlib.metadata.distributions(name=package, path=places)), None)
