"""Where a record was measured: the machine, the versions, and a digest of the sources."""

import contextlib
import functools
import hashlib
import os
import platform
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import psutil

from ..clock import pace
from ..peers.packages import version
from ..peers.sources import git_commit

PACKAGES = (
    *("plumbob", "numpy", "scipy", "numba", "pin", "mujoco", "example-robot-data"),
    *("gymnasium", "dm_control", "matplotlib"),
)
ROOT = Path(__file__).resolve().parents[2]
_PACKAGES = ("reference", "crosscheck", "verify", "bench", "plumbob/process")
# Folders that only show numbers, never imported by a measurement; others may change a number.
PRESENTATION = (
    *("bench/compare", "bench/figures", "bench/page", "bench/player", "bench/show"),
    *("bench/ranking", "bench/tables", "verify/screen"),
)
# The line of an experiment's file above which it measures, and below which it only shows numbers.
DIVIDER = b"# What is shown."


@functools.cache
def stamp() -> dict[str, Any]:
    """Return machine, versions and sources; a record with another stamp is measured again."""
    return {"machine": machine(), "versions": versions(), "source": source_digest()}


def machine() -> dict[str, Any]:
    """Return the facts that determine the speed, without names of the machine or its owner."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_gib": round(psutil.virtual_memory().total / 2**30, 1),
        "system": f"{platform.system()} {platform.machine()}",
    }


def conditions() -> dict[str, Any]:
    """Return conditions that may influence, but do not invalidate, a measurement now.

    "commit" is the commit of our sources. "pace" is the time of a fixed piece of work [s], to show
    the drift of a machine. "affinity" is the number of cores for this process, and "load" the
    system's over the last minute.
    """
    affinity = (
        {"affinity": len(os.sched_getaffinity(0))} if hasattr(os, "sched_getaffinity") else {}
    )
    load = round(psutil.getloadavg()[0], 2)
    return {"commit": _our_commit(), "pace": pace(), **affinity, "load": load}


@functools.cache
def _our_commit() -> str:
    return commit_of(ROOT)


def commit_of(root: Path) -> str:
    """Return the commit of sources, and whether changed since; "" outside of git."""
    return git_commit(root, _PACKAGES) if (root / ".git").exists() else ""


def difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return how a stamp differs from another, "" if equal."""
    for part, title in (("machine", "another machine"), ("versions", "other versions")):
        old, new = before.get(part, {}), now.get(part, {})
        changes = [
            f"{name} {old.get(name) or 'none'}, now {new.get(name) or 'none'}"
            for name in {**old, **new}
            if old.get(name) != new.get(name)
        ]
        if changes:
            return f"{title} ({'; '.join(changes)})"
    old, new = before.get("source", "none"), now.get("source", "none")
    return f"other sources ({old}, now {new})" if old != new else ""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages in use, "" of a missing package."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


def source_digest() -> str:
    """Return twelve hex digits over every text that can change a number."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + measuring_part(path))
    return digest.hexdigest()[:12]


def measuring_part(path: Path) -> bytes:
    """Return the text of a file; of an experiment's file, the text above the line `DIVIDER`."""
    text = path.read_bytes()
    is_experiment = path.parent == ROOT / "bench" / "experiments"
    return text.partition(b"\n" + DIVIDER)[0] if is_experiment else text


def source_files() -> list[Path]:
    """Return all files of the three packages except files that only show numbers."""
    files = []
    for path in (path for name in _PACKAGES for path in (ROOT / name).rglob("*") if path.is_file()):
        parts = path.relative_to(ROOT).parts
        shows = any("/".join(parts[:n]) in PRESENTATION for n in range(2, 4))
        shows |= parts[:2] == ("bench", "experiments") and path.suffix == ".toml"  # captions
        if not shows and "__pycache__" not in parts:
            files.append(path)
    return sorted(files)


def _processor() -> str:
    """Return the model of the processor, which psutil does not know."""
    with contextlib.suppress(OSError):
        info = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
        if model := re.search(r"^model name\s*:(.*)", info, re.MULTILINE):
            return model[1].strip()
    return platform.processor() or "unknown processor"
