"""The terminal: tables as text, the bar of a long run."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .presentation.tables import Table


def print_table(table: "Table") -> None:
    """Print a table with what it says: aligned on a terminal, as Markdown in a pipe."""
    from .presentation.tables import markdown

    if sys.stdout.isatty():
        print_aligned(table)
    else:
        print(markdown(table))


def print_tables(suites: Sequence[str], output: Path) -> None:
    """Print the tables that come from these suites, with what they say."""
    from .harness.record import RecordFile
    from .presentation.results import Results, plain, sift
    from .presentation.sections import tables

    records = [plain(record) for record in RecordFile(output).read().records]
    records, _ = sift(lambda results: tables(results, suites), records)
    for made in tables(Results(records), suites):
        if made.rows:
            print_aligned(made)


def print_summary(table: "Table") -> None:
    """Print what a table is called and says."""
    print(f"\n{table.title}\n  {table.summary.sentence}".rstrip())
    print("".join(f"    {point}\n" for point in table.summary.points), end="", flush=True)


def print_aligned(table: "Table") -> None:
    """Print a table with what it says; as wide as the terminal, or very wide in a pipe."""
    print_summary(table)
    _print(_aligned(table), 240)


def _print(shown: Any, width: int) -> None:
    from rich.console import Console

    Console(
        width=None if sys.stdout.isatty() else width, highlight=False, markup=False, emoji=False
    ).print(shown)


def _aligned(table: "Table") -> Any:
    """Return a table as rich prints it, rows that miss something in red."""
    import rich.table
    from rich.text import Text

    from .presentation.tables import words

    shown = rich.table.Table(box=None, header_style="bold", pad_edge=False)
    for column in table.columns:
        shown.add_column(column.heading, justify="left" if column.words else "right")
    for row in table.rows:
        missed = any(str(cell).startswith("MISSED") for cell in row)
        shown.add_row(*(Text(words(cell)) for cell in row), style="bold red" if missed else None)
    return shown


def print_verdicts(verdicts: Sequence[Any]) -> None:
    """Print the table of verdicts."""
    from .presentation.tables import Column, Table

    words = {name: Column(name, words=True) for name in ("claim", "verdict")}
    numbers = map(Column, ("cases", "largest difference", "tolerance"))
    rows = [
        (
            verdict.claim.name,
            verdict.cases,
            verdict.difference,
            verdict.claim.tolerance.value,
            "held" if verdict.holds else f"MISSED: {verdict.failure}",
        )
        for verdict in verdicts
    ]
    table = Table("verdicts", "", (words["claim"], *numbers, words["verdict"]), tuple(rows))
    _print(_aligned(table), 120)
    print(f"{sum(verdict.holds for verdict in verdicts)} of {len(rows)} claims held")


def progress() -> Any:
    """Return a progress bar on a terminal, and nothing to see in a pipe."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    text = TextColumn("{task.description}", markup=False)
    return Progress(
        *(BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn(), text),
        console=Console(stderr=True),
        transient=True,
        refresh_per_second=2,
        disable=not sys.stderr.isatty(),
    )
