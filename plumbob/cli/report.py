"""The command `report`: write tables, figures and the page from the records, or one table."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from plumbob.text.printable import visible

from .options import REPORT, SUCCESS, File, Texts, argument, flag, option, valid_name
from .terminal import print_lines, print_outcome

if TYPE_CHECKING:
    from plumbob.bench.tables.table import Table

FORMATS = ("md", "tex", "csv", "html")


def report(
    folder: Annotated[
        File, argument("[FOLDER]", "Folder of the records.  [default: report]")
    ] = None,
    *,
    output: Annotated[
        File, option("PATH", "Output folder; with --table, output file.", "--output", "-o")
    ] = None,
    name: Annotated[str, option("NAME", "Print one table; see --list.", "--table")] = "",
    form: Annotated[str, option("FORMAT", f"Format: {', '.join(FORMATS)}.", "--format")] = "md",
    columns: Annotated[
        Texts, option("COLUMNS", "Headings, such as 'solver, within tolerance'.")
    ] = None,
    rows: Annotated[Texts, option("FILTER", "Rows: solver=Newton, or robot~UR for a part.")] = None,
    order: Annotated[str, option("COLUMN", "Sort rows, best or smallest first.", "--sort")] = "",
    names: Annotated[bool, flag("List the tables; with --table, its columns.", "--list")] = False,
) -> int:
    """Write tables (Markdown, LaTeX, CSV), figures and one offline page from the records.

    With --table, print one table, or some of its columns and rows, for a paper.
    """
    valid_name("format", form, FORMATS)
    if not name and not names:
        if columns or rows or order:
            raise ValueError("--columns, --rows and --sort: expected --table, which they are of")
        if folder and output:
            raise ValueError(f"--output: expected --table, or no folder but this; got {folder} too")
        return write_report(folder or output or REPORT)
    tables = _tables(folder or (output if names else None) or REPORT)
    if not name:
        return _list_tables(tables)
    by_name = {table.name: table for table in tables}
    table = by_name[valid_name("table", name, by_name)]
    if names:
        return _list_columns(table)
    from plumbob.bench.tables import selection

    table = selection.selected(table, columns or [], rows or [], order)
    return _write(formatted(table, form), output)


def write_report(output: Path) -> int:
    """Write the report and print its summary."""
    from plumbob.bench.page.report import write

    print_outcome(write(output))
    return SUCCESS


def _tables(folder: Path) -> list["Table"]:
    """Return the tables of a folder's records."""
    from plumbob.bench.page.sections import tables
    from plumbob.bench.tables.results import results_of

    return tables(results_of(folder)[0])


def _list_tables(tables: list["Table"]) -> int:
    from plumbob.bench.tables.columns import text
    from plumbob.bench.tables.table import Column, Table, cells

    columns = (
        text("table", lambda table: table.name),
        text("title", lambda table: table.title),
        Column("rows", read=lambda table: len(table.rows)),
        Column("columns", read=lambda table: len(table.columns)),
    )
    print_lines(Table("tables", "", columns, cells(columns, tables)))
    return SUCCESS


def _list_columns(table: "Table") -> int:
    for column in table.columns:
        marks = (f"{column.best} is best" * bool(column.best), "folded" * column.folded)
        about = ", ".join(filter(None, marks))
        print(column.heading + (f" ({about})" if about else ""))
    return SUCCESS


def formatted(table: "Table", form: str) -> str:
    """Return a table in any of `FORMATS`."""
    from plumbob.bench.tables import writers
    from plumbob.bench.tables.latex import latex

    formats = {
        "md": writers.markdown, "tex": latex, "csv": writers.comma_separated,
        "html": writers.html_fragment,
    }  # fmt: skip
    return formats[form](table)


def _write(text: str, output: Path | None) -> int:
    """Write a text to standard output or a file."""
    from plumbob.process.paths import check_regular

    if output is None:
        print(text, end="")
        return SUCCESS
    if output.is_dir():
        raise ValueError(
            f"--output: expected a file for the table, got the folder {output}; the folder of the "
            f"records stands first: plumbob report {output} --table ..."
        )
    check_regular(output)
    output.write_text(text, encoding="utf-8")
    print(f"{visible(str(output))} written")
    return SUCCESS
