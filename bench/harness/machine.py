"""Where a record was measured: the machine, the versions, and a digest of the sources."""

import functools
import hashlib
import importlib.metadata
import os
import platform
from pathlib import Path
from typing import Any

PACKAGES = (
    "plumbob",
    "numpy",
    "scipy",
    "numba",
    "cholespy",
    "pin",
    "mujoco",
    "example-robot-data",
    "gymnasium",
    "dm_control",
    "pytest-benchmark",
    "matplotlib",
)
_ROOT = Path(__file__).resolve().parents[2]
_PACKAGES = ("reference", "crosscheck", "bench")
# What only shows numbers; all else may change one. None of these is imported by what measures.
PRESENTATION = ("bench/cli.py", "bench/show.py", "bench/presentation")
# Likewise in every experiment.
PRESENTATION_FILES = ("tables.py", "figures.py", "readings.py", "files.py")


@functools.cache
def stamp() -> dict[str, Any]:
    """Return machine, versions and sources; a record with another stamp is measured again."""
    return {"machine": machine(), "versions": versions(), "source": source_digest()}


def machine() -> dict[str, Any]:
    """Return what the speed depends on; nothing that names the machine or its owner."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count(),
        "memory_gib": _memory_gib(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that take part, "" where one is missing."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = ""
    return found


def source_digest() -> str:
    """Return twelve hex digits over every file that can change a number."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(str(path.relative_to(_ROOT)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def source_files() -> list[Path]:
    """Return all files of the three packages but those that only show numbers."""
    every = (path for name in _PACKAGES for path in (_ROOT / name).rglob("*") if path.is_file())
    return sorted(path for path in every if not _is_left_out(path.relative_to(_ROOT).parts))


def _is_left_out(parts: tuple[str, ...]) -> bool:
    shows = "/".join(parts[:2]) in PRESENTATION
    shows |= parts[:2] == ("bench", "experiments") and parts[-1] in PRESENTATION_FILES
    return shows or "__pycache__" in parts


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown processor"


def _memory_gib() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (AttributeError, OSError, ValueError):
        return None
