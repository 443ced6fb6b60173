"""Which solver a command line means, and the door that it comes through."""

from collections.abc import Sequence

from crosscheck.conformance.contestant import Contestant
from crosscheck.conformance.doors.line_process import LIMITS, Limits
from crosscheck.conformance.doors.program import ProgramContestant
from crosscheck.conformance.doors.python_file import python_contestant
from crosscheck.conformance.sentence import sentence

from .words import Say


def limits(seconds: float | None, mebibytes: int | None) -> Limits:
    """Return the limits of a program; the first request of a task may take longer, to compile."""
    chosen = LIMITS
    if seconds is not None:
        chosen = chosen._replace(request=seconds, first=max(seconds, chosen.first))
    if mebibytes is not None:
        chosen = chosen._replace(memory=mebibytes << 20)
    return chosen


def opened(words: Sequence[str], chosen: Limits, say: Say) -> Contestant:
    """Return the solver behind its door.

    Args:
        words: a Python file, file.py:object or module:object; or "--", a program, its arguments.
        chosen: what it may take.
        say: for what is wrong with the words.

    Raises:
        ValueError: if the words name no solver.
    """
    if words[:1] == ["--"] and len(words) > 1:
        return ProgramContestant(words[1:], None, chosen)
    if not words or words == ["--"]:
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
    if not words[0].partition(":")[0].endswith(".py") and ":" not in words[0]:
        raise ValueError(say(sentence(
            "solver: expected a Python file or module:object, got {word}; a program stands behind "
            "--, as in plumbob verify -- {word}", word=words[0],
        )))  # fmt: skip
    return python_contestant(words[0], chosen)
