"""The files of a user's solver: their digest and their commit."""

import ast
import hashlib
import importlib.machinery
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from .user_solver import Spec

# Files of a program larger than this [B] are interpreters rather than somebody's solver.
_LARGEST = 1 << 26


def digest_of(spec: Spec) -> str:
    """Return twelve hex digits over all files of a solver, "" if none is known."""
    files, digest = source_files(spec), hashlib.sha256()
    for path in files:
        digest.update(path.name.encode(errors="replace") + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12] if files else ""


def commit_of(spec: Spec) -> str:
    """Return the commit of a solver's files, and whether changed since; "" if none."""
    files = source_files(spec)
    return git_commit(files[0].parent, list(map(str, files))) if files else ""


def git_commit(folder: Path, paths: Sequence[str]) -> str:
    """Return the commit of a folder, and whether these paths differ; "" outside of git."""
    git = ["git", "-C", str(folder)]
    try:
        head = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, check=True)
        status = [*git, "status", "--porcelain", "--", *paths]
        changes = subprocess.run(status, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):  # no git, or no commit yet
        return ""
    return head.stdout.decode().strip() + (" with changes" if changes else "")


def source_files(spec: Spec) -> list[Path]:
    """Return the files of a Python file, of a module, or of a command, the main file first.

    A Python file brings along its imports from its own folder, a module its package.
    """
    if not isinstance(spec, str):
        paths = [Path(word).resolve() for word in spec if "/" in word or "." in word]
        return list(filter(_is_source, paths))
    place = spec.partition(":")[0]
    if place.endswith(".py"):
        return list(_with_imports(Path(place).resolve(), {}))
    if Path(place).is_file():
        return list(filter(_is_source, [Path(place).resolve()]))
    return _files_of_module(place)


def _is_source(path: Path) -> bool:
    return path.is_file() and path.stat().st_size <= _LARGEST


def _with_imports(path: Path, files: dict[Path, None]) -> dict[Path, None]:
    """Add a file and its imports from its own folder, however deep."""
    if path not in files and _is_source(path):
        files[path] = None
        for name in _imported(path):
            place = path.parent.joinpath(*name.split("."))
            _with_imports(place.with_name(f"{place.name}.py"), files)
            _with_imports(place / "__init__.py", files)
    return files


def _imported(path: Path) -> Iterator[str]:
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):  # an error for whoever loads it
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            prefix = f"{node.module}." if node.module else ""
            yield from (prefix + alias.name for alias in node.names)
            yield from [node.module] if node.module else []


def _files_of_module(name: str) -> list[Path]:
    path = [str(Path.cwd()), *sys.path]
    package = importlib.machinery.PathFinder.find_spec(name.split(".")[0], path)
    if package is None or not package.origin:
        return []
    folders = map(Path, package.submodule_search_locations or ())
    submodules = sorted(path for folder in folders for path in folder.rglob("*.py"))
    return list(dict.fromkeys([Path(package.origin), *submodules]))
