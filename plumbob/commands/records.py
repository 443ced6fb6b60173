"""The command `records`: list, merge and drop what is on record."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..help_text import Command, Group, block
from .options import REPORT, SUCCESS

if TYPE_CHECKING:
    from plumbob.bench.harness.record import Key, Record
    from plumbob.bench.tables.table import Table

app = typer.Typer(cls=Group, rich_markup_mode=None)

Folder = Annotated[Path, typer.Argument(metavar="[FOLDER]", help="A folder of records.")]
Suites = Annotated[list[str] | None, typer.Option("--suite", help="Of these suites.")]
Solvers = Annotated[list[str] | None, typer.Option("--solver", help="Of these solvers.")]
Problems = Annotated[list[str] | None, typer.Option("--problem", help="On these problems.")]
Failed = Annotated[bool, typer.Option("--failed", help="That could not be measured.")]
Superseded = Annotated[
    bool, typer.Option("--superseded", help="Under settings that are no longer asked for.")
]


@app.callback(
    epilog=block(
        "Examples",
        "plumbob records list",
        "plumbob records merge laptop desktop --into both",
        'plumbob records drop --solver "My solver"',
    )
)
def records() -> None:
    """List, merge or drop what is on record; nothing else ever removes a record."""


@app.command("list", cls=Command, epilog=block("Examples", "plumbob records list report"))
def list_records(
    folder: Folder = REPORT,
    suites: Suites = None,
    solvers: Solvers = None,
    problems: Problems = None,
    failed: Failed = False,
    superseded: Superseded = False,
) -> int:
    """Count what is on record, by suite and solver, and where it was measured."""
    from plumbob.bench.harness.record import FINISHED
    from plumbob.bench.tables.results import printable

    from ..terminal import print_aligned

    wanted = _selection(suites, solvers, problems, failed, superseded)
    measured = (record for record in _read(folder) if record.suite != FINISHED)
    found = [printable(record) for record in measured if wanted(record)]
    print_aligned(_table(folder, found))
    return SUCCESS


@app.command(
    "merge",
    cls=Command,
    epilog=block("Examples", "plumbob records merge laptop desktop --into both"),
)
def merge(
    folders: Annotated[
        list[Path], typer.Argument(metavar="FOLDER...", help="Folders to take records from.")
    ],
    into: Annotated[Path, typer.Option("--into", metavar="DIR", help="The folder to add to.")],
) -> int:
    """Add the records of folders to another; of two of the same measurement the later counts.

    One that failed never takes the place of one that did not. The folders stay as they are.
    """
    from plumbob.bench.harness.folder_lock import locked
    from plumbob.bench.harness.record import RecordFile, check_folder

    given = [record for folder in folders for record in _read(folder)]
    check_folder(into)
    with locked(into):
        file = RecordFile(into)
        present = {record.key: record for record in file.read(typed=False).records}
        added = _newer(present, given)
        if added:
            file.append(added.values())
    replaced = len(added.keys() & present.keys())
    print(f"{len(added)} added to {into}, {replaced} of them in place of earlier ones; "
          f"{len(given) - len(added)} left, for {into} has them or later ones")  # fmt: skip
    if len(places := _machines({**present, **added}.values())) > 1:
        print(f"{into} now holds times of {len(places)} machines: {'; '.join(sorted(places))}")
    return SUCCESS


@app.command(
    "drop", cls=Command, epilog=block("Examples", 'plumbob records drop --solver "My solver"')
)
def drop(
    folder: Folder = REPORT,
    suites: Suites = None,
    solvers: Solvers = None,
    problems: Problems = None,
    failed: Failed = False,
    superseded: Superseded = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would go.")] = False,
) -> int:
    """Remove records for good: those that fit all that is given."""
    from plumbob.bench.harness.folder_lock import locked
    from plumbob.bench.harness.record import RecordFile

    if not (suites or solvers or problems or failed or superseded):
        raise ValueError("drop: expected --suite, --solver, --problem, --failed or --superseded")
    wanted = _selection(suites, solvers, problems, failed, superseded)
    count = sum(map(wanted, _read(folder)))
    if not dry_run and count:
        with locked(folder):
            RecordFile(folder).drop(wanted)
    print(f"{count} {'would be ' if dry_run else ''}dropped from {folder}")
    return SUCCESS


def _read(folder: Path) -> "list[Record]":
    from plumbob.bench.harness.record import on_record

    return on_record(folder, typed=False).records


def _selection(
    suites: list[str] | None, solvers: list[str] | None, problems: list[str] | None,
    failed: bool, superseded: bool,
) -> "Callable[[Record], bool]":  # fmt: skip
    """Return whether a record fits all that is given."""
    names = {"suite": suites, "solver": solvers, "problem": problems}
    given = {name: values for name, values in names.items() if values}

    def wanted(record: "Record") -> bool:
        return (
            all(getattr(record, name) in values for name, values in given.items())
            and (bool(record.failed) or not failed)
            and (record.superseded or not superseded)
        )

    return wanted


def _newer(present: "dict[Key, Record]", given: "Iterable[Record]") -> "dict[Key, Record]":
    """Return the records that are later than those of their key, or measured where it failed."""
    added: dict[Key, Record] = {}
    for record in given:
        other = added.get(record.key, present.get(record.key))
        if other is None or _rank(record) > _rank(other):
            added[record.key] = record
    return added


def _rank(record: "Record") -> tuple[bool, str]:
    return not record.failed, record.when


def _machines(records: "Iterable[Record]") -> set[str]:
    """Return the machines that records were measured on, in words."""
    from plumbob.bench.tables.results import counted
    from plumbob.bench.text import visible

    machines = (record.stamp.get("machine", {}) for record in records if record.stamp)
    forms = {"cores": lambda n: counted(n, "core"), "memory_gib": "{} GiB".format}
    texts = (", ".join(forms.get(name, str)(m[name]) for name in m if m[name]) for m in machines)
    return {visible(text) for text in texts if text}


def _table(folder: Path, records: "list[Record]") -> "Table":
    """Return a row for each suite and solver."""
    from plumbob.bench.tables.columns import text
    from plumbob.bench.tables.table import Column, Summary, Table, cells

    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        groups.setdefault((record.suite, record.solver), []).append(record)
    columns = (
        text("suite", lambda group: group[0].suite),
        text("solver", lambda group: group[0].solver),
        Column("records", read=len),
        Column("failed", read=lambda group: sum(bool(record.failed) for record in group)),
        Column("superseded", read=lambda group: sum(record.superseded for record in group)),
        text("latest", lambda group: max(record.when for record in group)),
        text("commits", lambda group: ", ".join(sorted({r.commit for r in group} - {""}))),
    )
    places = "; ".join(sorted(_machines(records)))
    summary = Summary(f"{len(records)} records, measured on {places or 'no machine'}")
    rows = cells(columns, groups.values())
    return Table("records", f"Records in {folder}", columns, rows, summary=summary)
