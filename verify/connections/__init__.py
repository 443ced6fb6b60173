"""Open a solver: a Python file or object, any program, a folder of answers."""

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from ..exchange import Connection
from .files import FileConnection
from .losses import LIMITS, ProcessLimits
from .program import ProgramConnection

__all__ = ["LIMITS", "ProcessLimits", "open_connection"]

# After this share of its time a solver's line is noted, before a timeout.
NOTED_AFTER = 0.6
_HOME = str(Path(__file__).parents[3])
# Our packages come first only while the host is loaded; then the solver's modules come first.
_START = """\
import sys
home, spec, folder, patience = sys.argv[1:]
is_known = home in sys.path
if not is_known:
    sys.path.insert(0, home)
from plumbob.verify.connections.host import serve
if not is_known:
    sys.path.append(sys.path.pop(0))
serve(spec, folder, float(patience))
"""


def open_connection(spec: str | Path | Sequence[str], limits: ProcessLimits = LIMITS) -> Connection:
    """Return a solver of any kind, whose process starts with the first request.

    `spec` is a command as a list of words; a Python file, file.py:object or module:object; a
    program's file; or a folder of answers. Raise ValueError of an unknown name.
    """
    if not isinstance(spec, str | Path):
        return ProgramConnection(spec, limits=limits)
    text, path = str(spec), Path(spec)
    if path.is_dir():
        return FileConnection(path)
    if text.partition(":")[0].endswith(".py") or (":" in text and not path.exists()):
        return _python_connection(text, limits)
    if path.is_file() and os.access(path, os.X_OK):
        return ProgramConnection([str(path.resolve())], limits=limits)
    if path.is_file():
        raise ValueError(
            f"solver: expected a Python file or a program, got {text}, which is neither: give the "
            f"command that runs it, as in: -- node {text}"
        )
    raise ValueError(
        "solver: expected a Python file, module:object, a program or a folder of answers, got "
        f"{text}, which does not exist"
    )


def _python_connection(spec: str, limits: ProcessLimits) -> ProgramConnection:
    """Return the solver in a file, file.py:object or module:object, run by this interpreter.

    A file runs in its own folder, a module in the working directory.
    """
    source, colon, attribute = spec.partition(":")
    folder = Path.cwd()
    if source.endswith(".py"):
        path = Path(source).resolve()
        if not path.is_file():
            raise ValueError(f"solver: expected a Python file, got {source}, which does not exist")
        folder, spec = path.parent, f"{path}{colon}{attribute}"
    patience = str(NOTED_AFTER * limits.request)
    command = [sys.executable, "-P", "-c", _START, _HOME, spec, str(folder), patience]
    return ProgramConnection(command, folder, limits)
