"""Problems of a user's own from files: Python, URDF, MJCF, BVH, or a folder of these."""

import inspect
import runpy
from collections.abc import Iterator, Sequence
from pathlib import Path

from plumbob.reference.formats.source import read_bytes

from . import models, own
from .own import OwnProblem, clean
from .robots import ROBOTS

SUFFIXES = (".py", ".urdf", ".xml", ".mjcf", ".bvh")


def read(
    words: Sequence[str], suites: Sequence[str], effector: str | None
) -> tuple[list[OwnProblem], list[str]]:
    """Return the problems in files, and the names of all selected problems.

    Raises:
        ValueError: if a file cannot be read, or has no problem for the suites.
    """
    every: list[OwnProblem] = []
    names: list[str] = []
    for word in words:
        path = Path(word)
        if not path.exists() and path.suffix.lower() not in SUFFIXES:
            names.append(word)
            continue
        problems = [problem for problem in _read(path, effector) if problem.suite in suites]
        if not problems:
            raise ValueError(f"problem: expected one for {' or '.join(suites)}, got {word}")
        every += problems
        names += [name for problem in problems for name in problem.recorded]
    doubled = [name for i, name in enumerate(names) if name in names[:i]]
    if doubled:
        raise ValueError(f"problem: expected different names, got {doubled[0]!r} twice")
    return every, names


def _read(path: Path, effector: str | None) -> Iterator[OwnProblem]:
    """Yield the problems of a file, or of all files of a folder."""
    suffix, name = path.suffix.lower(), clean(path.stem)
    if path.is_dir():
        for file in sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES):
            yield from _read(file, effector)
    elif not path.is_file():
        raise ValueError(f"problem: expected a file or a folder, got {path}, which does not exist")
    elif suffix not in SUFFIXES:
        raise ValueError(f"problem: expected a folder or {', '.join(SUFFIXES)}, got {path}")
    elif suffix == ".py":
        yield from _in_python(path)
    elif suffix == ".bvh":
        yield models.skeleton(path, name, effector)
    else:
        name = f"{name} of yours" if name in ROBOTS else name
        yield OwnProblem(name, robot=models.robot(path, name, effector))


def _in_python(path: Path) -> Iterator[OwnProblem]:
    """Yield the problem of each function without arguments: of a cloth if with springs."""
    read_bytes(path)  # refuses a file without end
    try:
        members = runpy.run_path(str(path), run_name=path.stem)
        fields = {
            name: {"name": name, **function()}
            for name, function in members.items()
            if inspect.isfunction(function) and function.__module__ == path.stem
            if name[0] != "_" and not inspect.signature(function).parameters
        }
    except (Exception, SystemExit) as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())[:200]
        raise ValueError(f"{path}: expected problems, got {why}") from None
    if not fields:
        raise ValueError(f"{path}: expected functions without arguments, got none")
    for function, content in fields.items():
        make = own.cloth if "springs" in content else own.skeleton
        try:
            yield make(**{**content, "name": clean(str(content["name"]))})
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {function}: {error}") from None
