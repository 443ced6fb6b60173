"""The files that `verify` writes: JSON, JUnit XML, a page, failing cases."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ..judgement import Report
from ..sentence import Sentence, sentence, visible
from . import json_file, junit, page, saved, terminal
from .question import Question
from .words import GOOD, Presentation

FAILURES = Path("plumbob_failures")
SCREEN = Path("/dev/stdout")
RIGHT, WRONG, FAILED = 0, 1, 2


class Files(NamedTuple):
    """The files to write, None for none; a folder gets all of them and the failing cases."""

    json: Path | None
    junit: Path | None
    html: Path | None
    card: Path | None
    folder: Path | None

    def paths(self) -> tuple[Path | None, ...]:
        """Return the paths of JSON, JUnit XML, the page and the card."""
        paths = self.json, self.junit, self.html, self.card
        if self.folder is None:
            return paths
        names = "verdict.json", "verdict.xml", "index.html", "card.svg"
        return tuple(path or self.folder / name for path, name in zip(paths, names, strict=True))

    def write(self, report: Report, question: Question, context: Presentation) -> int:
        """Print the screen, write the files, and return the exit code: 2 if writing fails."""
        failures: list[Sentence] = []
        folder = self.folder / "failures" if self.folder else FAILURES
        options = folder, question.seed, question.thorough
        paths = {
            (task.task, task.method): question.rerun
            or _attempt(folder, partial(saved.save, task, *options), failures)
            for task in report.tasks
        }
        context = context._replace(files={key: path for key, path in paths.items() if path})
        screen = _attempt(SCREEN, partial(_show, report, context), failures)
        makers = (
            lambda: json_file.text(report, context.say),
            lambda: junit.text(report, context.say),
            lambda: page.render(report, context),
            lambda: page.card(report, context),
        )
        finished = [
            _attempt(path, partial(_write, path, make), failures)
            for path, make in zip(self.paths(), makers, strict=True)
            if path is not None
        ]
        if screen and any(finished):
            print(" ".join(visible(str(path)) for path in finished if path))
        for failure in failures:
            print(f"plumbob: {context.say(failure)}", file=sys.stderr)
        return FAILED if failures else RIGHT if report.verdict in GOOD else WRONG


def _show(report: Report, context: Presentation) -> Path:
    with suppress(BrokenPipeError, SystemExit):  # the files are still written
        terminal.show(report, context)
    return SCREEN


def _write(path: Path, make: Callable[[], str]) -> Path:
    path.write_text(make(), encoding="utf-8")
    return path


def _attempt(path: Path, write: Callable[[], Path | None], failures: list[Sentence]) -> Path | None:
    """Return the written file; on an error add a sentence and return None."""
    try:
        return write()
    except Exception as error:
        why = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        failures.append(sentence("{file} could not be written: {why}", file=path, why=why))
        return None
