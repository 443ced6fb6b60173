"""Which solver a command line means, and the door that it comes through."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from ..contestant import Contestant
from ..sentence import sentence
from ..solvers import LIMITS, Limits, open_contestant
from ..solvers.export import export_cases
from ..solvers.files import FileContestant
from .terminal import WIDTH, wrapped
from .words import Say

# What stands before a program, and before a folder of answers.
PROGRAM, ANSWERS = "--", "--answers"


def limits(seconds: float | None, mebibytes: int | None) -> Limits:
    """Return the limits of a program; the first request of a task may take longer, to compile.

    Raises:
        ValueError: if the time is none.
    """
    chosen = LIMITS
    if seconds is not None and not 0.0 < seconds < float("inf"):
        raise ValueError(f"time-limit: expected seconds above 0, got {seconds}")
    if seconds is not None:
        chosen = chosen._replace(request=seconds, first=max(seconds, chosen.first))
    if mebibytes is not None:
        chosen = chosen._replace(memory=mebibytes << 20)
    return chosen


def opened(words: Sequence[str], chosen: Limits, say: Say) -> Contestant:
    """Return the solver behind its door.

    Args:
        words: a Python file, module:object or the like; or "--", a program, its arguments; or
            "--answers" and a folder.
        chosen: what it may take.
        say: for what is wrong with the words.

    Raises:
        ValueError: if the words name no solver.
    """
    if words[:1] == [PROGRAM] and len(words) > 1:
        return open_contestant(words[1:], chosen)
    if words[:1] == [ANSWERS] and len(words) > 2:
        raise ValueError(say(sentence(
            "answers: expected a folder in place of a solver, got {solver} as well",
            solver=" ".join(words[2:]),
        )))  # fmt: skip
    if words[:1] == [ANSWERS]:
        return FileContestant(Path(words[1]))
    if not words or words == [PROGRAM]:
        raise ValueError(say(sentence(
            "solver: expected a Python file, module:object, or -- and a program, got none; "
            "plumbob verify --template python writes a starter"
        )))  # fmt: skip
    if len(words) > 1:
        raise ValueError(say(sentence(
            "solver: expected one Python file or module:object, got {count} words; a program "
            "stands behind --, as in plumbob verify -- {program}",
            count=len(words), program=" ".join(words),
        )))  # fmt: skip
    return open_contestant(words[0], chosen)


def exported(folder: Path, tasks: Sequence[str], seed: int, thorough: bool, say: Say) -> list[str]:
    """Write cases into a folder and return what to do next.

    Raises:
        ValueError: if the folder holds something else.
    """
    count = export_cases(folder, None, tasks or None, seed, thorough)
    place = shlex.quote(str(folder))
    told = (
        sentence("{count} cases are in {folder}; README.txt there says how to answer them.",
                 count=count, folder=place),
        sentence("Then: {command}", command=f"plumbob verify --answers {place}"),
    )  # fmt: skip
    return [line for one in told for line in wrapped(say(one), WIDTH)]
