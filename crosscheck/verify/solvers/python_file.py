"""A Python file, or an object of a module, as a contestant in a process of its own."""

import sys
from pathlib import Path

from .losses import LIMITS, ProcessLimits
from .program import ProgramContestant

# After this share of its time a solver's line is noted, in case it takes longer.
TOLD_AFTER = 0.6
_HOME = str(Path(__file__).parents[4])
# Ours is found first only while the host is loaded; then the solver's modules come first.
_START = """\
import sys
home, spec, folder, patience = sys.argv[1:]
ours = home in sys.path
if not ours:
    sys.path.insert(0, home)
from plumbob.crosscheck.verify.solvers.host import serve
if not ours:
    sys.path.append(sys.path.pop(0))
serve(spec, folder, float(patience))
"""


def python_contestant(spec: str, limits: ProcessLimits = LIMITS) -> ProgramContestant:
    """Return the solver in a file, file.py:object or module:object.

    A file runs in its own folder, a module in the present one, by the interpreter that runs this.

    Raises:
        ValueError: if there is no such file.
    """
    place, colon, attribute = spec.partition(":")
    folder = Path.cwd()
    if place.endswith(".py"):
        path = Path(place).resolve()
        if not path.is_file():
            raise ValueError(f"solver: expected a Python file, got {place}, which does not exist")
        folder, spec = path.parent, f"{path}{colon}{attribute}"
    patience = str(TOLD_AFTER * limits.request)
    command = [sys.executable, "-P", "-c", _START, _HOME, spec, str(folder), patience]
    return ProgramContestant(command, folder, limits)
