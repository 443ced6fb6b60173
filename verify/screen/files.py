"""The files of `verify`: JSON, JUnit XML, a page, failing cases."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from plumbob.text.printable import visible
from plumbob.text.sentence import Sentence, sentence

from ..connections import saved
from ..connections.command import CaseOptions
from ..judgement import Report
from . import json_file, junit, page, terminal
from .words import GOOD, Presentation, verdict_line

FAILURES = Path("plumbob_failures")
SCREEN = Path("/dev/stdout")
RIGHT, WRONG, FAILED, UNJUDGED = 0, 1, 2, 3


class WriteFailure(NamedTuple):
    """Why a file was not written."""

    sentence: Sentence
    is_of_system: bool  # whether the system refused, and no mistake of ours is to blame


class Files(NamedTuple):
    """The files to write, None for none; a folder gets all files and the failing cases."""

    json: Path | None
    junit: Path | None
    html: Path | None
    folder: Path | None

    def paths(self) -> tuple[Path | None, ...]:
        """Return the paths of JSON, JUnit XML and the page."""
        paths = self.json, self.junit, self.html
        if self.folder is None:
            return paths
        names = "verdict.json", "verdict.xml", "index.html"
        return tuple(path or self.folder / name for path, name in zip(paths, names, strict=True))

    def save(
        self, report: Report, options: CaseOptions, context: Presentation
    ) -> tuple[list[Path], Presentation, list[WriteFailure]]:
        """Write the files; return paths, the context with the failing cases, and the failures."""
        failures: list[WriteFailure] = []
        folder = self.folder / "failures" if self.folder else FAILURES
        arguments = folder, options.seed, options.thorough
        cases = {
            (task.task, task.method): options.rerun
            or _attempt(folder, partial(saved.save, task, *arguments), failures)
            for task in report.tasks
        }
        context = context._replace(files={key: path for key, path in cases.items() if path})
        makers = (
            lambda: json_file.text(report, context.say),
            lambda: junit.text(report, context.say),
            lambda: page.render(report, context),
        )
        finished = [
            _attempt(path, partial(_write, path, make), failures)
            for path, make in zip(self.paths(), makers, strict=True)
            if path is not None
        ]
        return [path for path in finished if path], context, failures

    def write(self, report: Report, options: CaseOptions, context: Presentation) -> int:
        """Write the files, print the screen, and return the exit code.

        The code is 2 if a file cannot be written, and 3 if the judge failed at a task and the other
        tasks are right. Our own mistake in a screen or a file leaves the code to the verdict.
        """
        finished, context, failures = self.save(report, options, context)
        if _attempt(SCREEN, partial(_show, report, context), failures):
            if finished:
                print(" ".join(visible(str(path)) for path in finished))
        elif not failures[-1].is_of_system:
            print("\n".join(context.say(verdict_line(task)) for task in report.tasks))
        for failure in failures:
            print(f"plumbob: {context.say(failure.sentence)}", file=sys.stderr)
        if any(failure.is_of_system for failure in failures):
            return FAILED
        if report.verdict not in GOOD and report.tasks:
            return WRONG
        return UNJUDGED if report.unjudged else RIGHT


def _show(report: Report, context: Presentation) -> Path:
    with suppress(BrokenPipeError, SystemExit):  # the files are still written
        terminal.show(report, context)
    return SCREEN


def _write(path: Path, make: Callable[[], str]) -> Path:
    path.write_text(make(), encoding="utf-8")
    return path


def _attempt(
    path: Path, write: Callable[[], Path | None], failures: list[WriteFailure]
) -> Path | None:
    """Return the written file; on an error add a failure and return None."""
    try:
        return write()
    except Exception as error:
        why = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        words = sentence("{file} could not be written: {why}", file=path, why=why)
        failures.append(WriteFailure(words, isinstance(error, OSError)))
        return None
