"""The doors that a solver comes through: Python, any program, a folder of answers."""

import os
from collections.abc import Sequence
from pathlib import Path

from ..contestant import Contestant
from .files import FileContestant
from .losses import LIMITS, ProcessLimits
from .program import ProgramContestant
from .python_file import python_contestant

__all__ = ["LIMITS", "ProcessLimits", "open_contestant"]


def open_contestant(spec: str | Path | Sequence[str], limits: ProcessLimits = LIMITS) -> Contestant:
    """Return a solver, whatever it is; nothing of it is started before it is asked.

    Args:
        spec: a command as a list of words; a Python file, file.py:object or module:object; a
            program's file; or a folder of answers.
        limits: of its process.

    Raises:
        ValueError: if there is nothing of the kind.
    """
    if not isinstance(spec, str | Path):
        return ProgramContestant(spec, limits=limits)
    text, path = str(spec), Path(spec)
    if path.is_dir():
        return FileContestant(path)
    if text.partition(":")[0].endswith(".py") or (":" in text and not path.exists()):
        return python_contestant(text, limits)
    if path.is_file() and os.access(path, os.X_OK):
        return ProgramContestant([str(path.resolve())], limits=limits)
    if path.is_file():
        raise ValueError(
            f"solver: expected a Python file or a program, got {text}, which is neither: give the "
            f"command that runs it, as in: -- node {text}"
        )
    raise ValueError(
        "solver: expected a Python file, module:object, a program or a folder of answers, got "
        f"{text}, which does not exist"
    )
