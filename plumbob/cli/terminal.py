"""Print tables and progress on the terminal."""

import contextlib
import shutil
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plumbob.bench.page.report import BenchReport
    from plumbob.bench.tables.results import Results
    from plumbob.bench.tables.table import Table
    from plumbob.crosscheck.verdict import ClaimVerdict

# The width of a pipe: each row and each sentence is a single line.
IN_A_PIPE = 10**6
# Seconds until a pipe gets its first line on progress, and the longest pause between lines.
PAUSE, LONGEST_PAUSE = 10.0, 60.0


def width() -> int:
    """Return the width of the terminal; practically unlimited in a pipe."""
    return shutil.get_terminal_size((IN_A_PIPE, 24)).columns


def print_tables(suites: Sequence[str], output: Path) -> None:
    """Print the tables of these suites that have numbers."""
    from plumbob.bench.page.sections import tables
    from plumbob.bench.tables.table import is_blank

    for table in tables(_results(suites, output), suites):
        if not is_blank(table):
            print_aligned(table, f"plumbob report {output} --table {table.name}")


def print_ending(suites: Sequence[str], output: Path) -> None:
    """Print the summary of a bench of these suites, in about eight lines."""
    from plumbob.bench.page.outcome import ending

    print("\n".join(ending(_results(suites, output), suites, width())))


def _results(suites: Sequence[str], output: Path) -> "Results":
    from plumbob.bench.measure.record import FINISHED, RecordFile
    from plumbob.bench.tables.results import Results

    records = RecordFile(output).read().records
    return Results(record for record in records if record.suite in (*suites, FINISHED))


def print_filled(text: str, indent: str = "") -> None:
    """Print a text in lines that fit, indented; nothing if empty."""
    from plumbob.bench.tables.aligned import filled

    if text:
        print("\n".join(f"{indent}{line}" for line in filled(text, width() - len(indent))))


def print_aligned(table: "Table", shown_by: str = "a wider terminal, or a pipe") -> None:
    """Print title, summary and rows of a table, and how to see the remaining columns."""
    from plumbob.reference.arguments import name_list

    print()
    print_filled(table.title)
    print_filled(table.summary.sentence)
    for point in table.summary.points:
        print_filled(point, "  ")
    if missing := print_lines(table):
        count = f"{len(missing)} of {len(table.columns)} columns"
        print_filled(f"{count} left out ({name_list(missing)}); all: {shown_by}")


def print_lines(table: "Table") -> list[str]:
    """Print the rows of a table; return the headings of the columns that do not fit."""
    from rich.console import Console

    from plumbob.bench.tables.aligned import aligned

    lines, _, left_out = aligned(table, width())
    console = Console(highlight=False, markup=False, emoji=False, soft_wrap=True)
    for line in lines:
        console.print(line)
    return left_out


def print_outcome(report: "BenchReport") -> None:
    """Print the summary of a report, in ten lines."""
    from plumbob.bench.page.outcome import outcome

    print("\n".join(outcome(report, width())), flush=True)


def print_verdicts(verdicts: Sequence["ClaimVerdict"]) -> None:
    """Print a row for each claim, the reasons of missed claims, and how many hold."""
    from plumbob.bench.measure.metrics import ratio
    from plumbob.bench.tables.table import Column, Table, cells

    def used(v: "ClaimVerdict") -> float | None:
        return None if v.claim.obstacle else ratio(v.difference, v.claim.tolerance.value)

    columns = (
        Column("claim", words=True, read=lambda v: v.claim.name),
        Column("verdict", words=True, read=lambda v: v.words),
        Column("cases", read=lambda v: v.cases),
        Column("largest difference", read=lambda v: None if v.claim.obstacle else v.difference),
        Column("tolerance", read=lambda v: v.claim.tolerance.value),
        Column("tolerance used", "%", read=used),
    )
    print_lines(Table("verdicts", "", columns, cells(columns, verdicts)))
    for verdict in verdicts:
        if verdict.failure:
            print(f"MISSED: {verdict.claim.name} ({verdict.failure})")
    obstacles = [verdict.claim.obstacle for verdict in verdicts if verdict.claim.obstacle]
    more = f"; {len(obstacles)} not checked: {obstacles[0]}" if obstacles else ""
    count = len(verdicts) - len(obstacles)
    print(f"{sum(verdict.holds for verdict in verdicts)} of {count} claims held{more}")


def progress() -> Any:
    """Return a progress bar, invisible in a pipe.

    The description takes the space unused by bar, count and time left. The field "kept" of its task
    counts steps without time.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn
    from rich.table import Column
    from rich.text import Text

    class Count(MofNCompleteColumn):
        def render(self, task: Any) -> Text:
            return Text("") if task.total is None else super().render(task)

    class TimeLeft(ProgressColumn):
        def render(self, task: Any) -> Text:
            return Text(_time_of(task))

    console = Console(stderr=True)
    rigid = Column(no_wrap=True)
    flexible = Column(no_wrap=True, overflow="ellipsis", ratio=1)
    return Progress(
        BarColumn(max(4, min(24, console.width // 6 - 1)), table_column=rigid.copy()),
        Count(table_column=rigid.copy()),
        TimeLeft(table_column=rigid.copy()),
        TextColumn("{task.description}", markup=False, table_column=flexible),
        console=console,
        transient=True,
        expand=True,
        refresh_per_second=2,
        disable=not sys.stderr.isatty(),
    )


@contextlib.contextmanager
def lines_in_a_pipe(bar: Any, pauses: tuple[float, float] | None = None) -> Iterator[None]:
    """Print the state of a progress bar now and then, where standard error is no terminal.

    `pauses` are the first and the longest pause [s].
    """
    end = threading.Event()

    def report() -> None:
        pause, longest_pause = pauses or (PAUSE, LONGEST_PAUSE)
        while not end.wait(pause):
            pause = min(1.5 * pause, longest_pause)
            for task in bar.tasks:
                print(_progress_line(task), file=sys.stderr, flush=True)

    if not sys.stderr.isatty():
        threading.Thread(target=report, daemon=True).start()
    try:
        yield
    finally:
        end.set()


def _progress_line(task: Any) -> str:
    """Return the state of a bar's task: its progress, the time left, and its description."""
    count = "" if task.total is None else f"{task.completed:g}/{task.total:g}, "
    return f"{count}{_time_of(task)}: {task.description}"


def _time_of(task: Any) -> str:
    """Return the time left of a bar's task, or the time so far if its end is unknown."""
    if task.total is None:
        return f"{task.elapsed or 0.0:.0f} s"
    return time_left(task.elapsed, task.completed, task.total, task.fields)


def time_left(
    elapsed: float | None, completed: float, total: float, fields: Mapping[str, Any]
) -> str:
    """Return the remaining time at the average pace so far: "1:05 left".

    "? left" before a hundredth is complete, since the first calls compile.
    """
    steps = completed - fields.get("kept", 0)
    if not elapsed or steps <= 0.01 * total:
        return "? left"
    minutes, seconds = divmod(round(elapsed / steps * (total - completed)), 60)
    hours, minutes = divmod(minutes, 60)
    clock = f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes}:{seconds:02}"
    return f"{clock} left"
