"""The command `records`: list, merge and drop records."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .help_text import Command, FittingGroup, epilog
from .options import REPORT, SUCCESS, Texts, argument, flag, option

if TYPE_CHECKING:
    from plumbob.bench.measure.record import Key, Record
    from plumbob.bench.tables.table import Table

app = typer.Typer(cls=FittingGroup, rich_markup_mode=None)

Folder = Annotated[Path, argument("[FOLDER]", "Folder of the records.")]
Suites = Annotated[Texts, option("NAME", "Only this suite.", "--suite")]
Solvers = Annotated[Texts, option("NAME", "Only this solver.", "--solver")]
Problems = Annotated[Texts, option("NAME", "Only this problem.", "--problem")]
Failed = Annotated[bool, flag("Only failed measurements.", "--failed")]
Superseded = Annotated[bool, flag("Only records with outdated settings.", "--superseded")]


@app.callback(invoke_without_command=True, epilog=epilog("records"))
def records(context: typer.Context) -> int:
    """List, merge or drop records. Only `drop` and the option --fresh delete records.

    Without a command: list the records in report.
    """
    return SUCCESS if context.invoked_subcommand else list_records()


@app.command("list", cls=Command, epilog=epilog("records list"))
def list_records(
    folder: Folder = REPORT,
    *,
    suites: Suites = None,
    solvers: Solvers = None,
    problems: Problems = None,
    failed: Failed = False,
    superseded: Superseded = False,
) -> int:
    """Count the records by suite and solver, and list the machines."""
    from plumbob.bench.measure.record import FINISHED
    from plumbob.bench.tables.results import printable

    from .terminal import print_aligned

    matches = _filter(suites, solvers, problems, failed, superseded)
    measured = (record for record in _read(folder) if record.suite != FINISHED)
    print_aligned(_table(folder, [printable(record) for record in measured if matches(record)]))
    return SUCCESS


@app.command("merge", cls=Command, epilog=epilog("records merge"))
def merge(
    folders: Annotated[list[Path], argument("FOLDER...", "Folders to take records from.")],
    into: Annotated[Path, option("DIR", "Folder to add to.", "--into")],
) -> int:
    """Add the records of folders to another; the latest of repeated measurements counts.

    A failed measurement never replaces a successful one. The folders are not changed.
    """
    from plumbob.bench.measure.folder_lock import locked
    from plumbob.bench.measure.record import RecordFile
    from plumbob.process.paths import check_folder

    candidates = [record for folder in folders for record in _read(folder)]
    check_folder(into)
    with locked(into):
        file = RecordFile(into)
        present = {record.key: record for record in file.read(typed=False).records}
        added: dict[Key, Record] = {}
        for record in candidates:
            other = added.get(record.key, present.get(record.key))
            if other is None or _rank(record) > _rank(other):
                added[record.key] = record
        if added:
            file.append(added.values())
    replaced = len(added.keys() & present.keys())
    print(f"{len(added):,} added to {into}, {replaced:,} of them in place of earlier ones; "
          f"{len(candidates) - len(added):,} left out: {into} has them or later ones")  # fmt: skip
    if len(machines := _machines({**present, **added}.values())) > 1:
        print(f"{into} now holds times of {len(machines)} machines: {'; '.join(sorted(machines))}")
    return SUCCESS


@app.command("drop", cls=Command, epilog=epilog("records drop"))
def drop(
    folder: Folder = REPORT,
    *,
    suites: Suites = None,
    solvers: Solvers = None,
    problems: Problems = None,
    failed: Failed = False,
    superseded: Superseded = False,
    dry_run: Annotated[
        bool, flag("Print the number of records, and keep them.", "--dry-run")
    ] = False,
) -> int:
    """Delete the records that match all options, permanently."""
    from plumbob.bench.measure.folder_lock import locked
    from plumbob.bench.measure.record import RecordFile

    if not (suites or solvers or problems or failed or superseded):
        raise ValueError("drop: expected --suite, --solver, --problem, --failed or --superseded")
    matches = _filter(suites, solvers, problems, failed, superseded)
    count = sum(map(matches, _read(folder)))
    if not dry_run and count:
        with locked(folder):
            RecordFile(folder).drop(matches)
    print(f"{count:,} {'would be ' if dry_run else ''}dropped from {folder}")
    return SUCCESS


def _read(folder: Path) -> "list[Record]":
    from plumbob.bench.measure.record import on_record

    return on_record(folder, typed=False).records


def _filter(
    suites: Texts, solvers: Texts, problems: Texts, failed: bool, superseded: bool
) -> "Callable[[Record], bool]":
    """Return a function that tells whether a record matches all options."""
    return lambda record: (
        (not suites or record.suite in suites)
        and (not solvers or record.solver in solvers)
        and (not problems or record.problem in problems)
        and (bool(record.failed) or not failed)
        and (record.superseded or not superseded)
    )


def _rank(record: "Record") -> tuple[bool, str]:
    return not record.failed, record.when


def _machines(records: "Iterable[Record]") -> set[str]:
    """Return the machines on which records were measured."""
    from plumbob.bench.tables.results import counted
    from plumbob.text.printable import visible

    machines = (record.stamp.get("machine", {}) for record in records if record.stamp)
    forms = {"cores": lambda number: counted(number, "core"), "memory_gib": "{} GiB".format}
    texts = (", ".join(forms.get(name, str)(m[name]) for name in m if m[name]) for m in machines)
    return {visible(text) for text in texts if text}


def _table(folder: Path, records: "list[Record]") -> "Table":
    """Return a table with a row for each suite and solver."""
    from plumbob.bench.tables.columns import text
    from plumbob.bench.tables.results import counted, grouped
    from plumbob.bench.tables.table import Column, Summary, Table, cells

    groups = grouped(records, lambda record: (record.suite, record.solver))
    columns = (
        text("suite", lambda group: group[0].suite),
        text("solver", lambda group: group[0].solver),
        Column("records", read=len),
        Column("failed", read=lambda group: sum(bool(record.failed) for record in group)),
        Column("superseded", read=lambda group: sum(record.superseded for record in group)),
        text("latest", lambda group: max(record.when for record in group)),
        text(
            "commits", lambda group: ", ".join(sorted({record.commit for record in group} - {""}))
        ),
    )
    machines = "; ".join(sorted(_machines(records))) or "no machine"
    summary = Summary(f"{counted(len(records), 'record')}, measured on {machines}")
    rows = cells(columns, groups.values())
    return Table("records", f"Records in {folder}", columns, rows, summary=summary)
