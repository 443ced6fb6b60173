"""The files that `verify` writes: JSON, JUnit XML, a page, failing cases."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from crosscheck.conformance.judgement import Report

from ..harness.record import check_regular
from ..text import visible
from . import json_file, junit, page, saved, terminal
from .question import Question
from .words import GOOD, Presentation

FAILURES = Path("plumbob_failures")
RIGHT, WRONG = 0, 1


class Files(NamedTuple):
    """Where to write, None for nowhere; all three and the failing cases into `folder`."""

    json: Path | None
    junit: Path | None
    html: Path | None
    folder: Path | None

    def check(self) -> None:
        """Find out before anything is asked whether the files can be written.

        Raises:
            ValueError, OSError: naming the file or folder that cannot.
        """
        from ..commands.options import writable

        for path in filter(None, self._paths()):
            check_regular(path)
            writable(path.parent)

    def _paths(self) -> tuple[Path | None, Path | None, Path | None]:
        if self.folder is None:
            return self.json, self.junit, self.html
        return (
            self.json or self.folder / "verdict.json",
            self.junit or self.folder / "verdict.xml",
            self.html or self.folder / "index.html",
        )

    def saved(self, report: Report, question: Question) -> Mapping[tuple[str, str], Path]:
        """Save the smallest failing case of each task, unless it is one that was asked again."""
        folder = self.folder / "failures" if self.folder else FAILURES
        paths = {
            (task.task, task.method): question.rerun
            or saved.save(task, folder, question.seed, question.thorough)
            for task in report.tasks
        }
        return {key: path for key, path in paths.items() if path is not None}

    def write(self, report: Report, context: Presentation) -> int:
        """Print the screen, write the files, and return the exit code."""
        makers = (
            lambda: json_file.text(report, context.say),
            lambda: junit.text(report, context.say),
            lambda: page.render(report, context),
        )
        written = []
        for path, make in zip(self._paths(), makers, strict=True):
            if path is not None:
                path.write_text(make(), encoding="utf-8")
                written.append(visible(str(path)))
        terminal.show(report, context)
        if written:
            print(" ".join(written))
        return RIGHT if report.verdict in GOOD else WRONG
