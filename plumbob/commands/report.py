"""The command `report`: write tables, figures and the page from the records, or one table."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plumbob.bench.text import visible

from ..help_text import block
from ..terminal import print_lines, print_outcome
from .options import REPORT, SUCCESS, known

if TYPE_CHECKING:
    from plumbob.bench.tables.table import Table

EXAMPLES = block(
    "Examples",
    "plumbob report",
    "plumbob report --output results/laptop",
    "plumbob report --list",
    "plumbob report --table cloth_dampers --list",
    "plumbob report --table cloth_dampers --format tex --width column -o dampers.tex",
    "plumbob report --table accuracy --columns 'solver, within tolerance' --rows 'problem~circle'",
)
FORMATS = ("md", "tex", "csv", "html")


Folder = Annotated[
    Path | None, typer.Argument(metavar="[FOLDER]", help="Folder of records, else report.")
]
Target = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="PATH", help="The folder as well; with --table, a file."
    ),
]
Name = Annotated[str, typer.Option("--table", metavar="NAME", help="Print one table; see --list.")]
Form = Annotated[
    str, typer.Option("--format", metavar="FORM", help=f"Of the table: {', '.join(FORMATS)}.")
]
Columns = Annotated[
    list[str] | None,
    typer.Option("--columns", metavar="COLUMNS", help="Headings or numbers: 'solver, 3-5'."),
]
Rows = Annotated[
    list[str] | None,
    typer.Option("--rows", metavar="FILTER", help="solver=Newton, robot~UR, 'median<10' ..."),
]
Order = Annotated[str, typer.Option("--sort", metavar="COLUMN", help="The best or least first.")]
Width = Annotated[
    str,
    typer.Option(
        "--width", metavar="LENGTH", help="Of LaTeX: column, page, or a length such as 120mm."
    ),
]
Listing = Annotated[bool, typer.Option("--list", help="List tables; with --table, its columns.")]


def report(  # noqa: PLR0913 -- one parameter an option
    folder: Folder = None,
    output: Target = None,
    name: Name = "",
    form: Form = "md",
    columns: Columns = None,
    rows: Rows = None,
    order: Order = "",
    width: Width = "page",
    names: Listing = False,
) -> int:
    """Write tables (Markdown, LaTeX, CSV), figures and one offline page from the records.

    With --table, print one table, or some of its columns and rows, for a paper.
    """
    known("format", form, FORMATS)
    if not name and not names:
        if columns or rows or order:
            raise ValueError("--columns, --rows and --sort: expected --table, which they are of")
        return write_report(_folder(folder, output))
    if not name:
        return _list_tables(folder or REPORT)
    table = _table(folder or REPORT, name)
    if names:
        return _list_columns(table)
    from plumbob.bench.tables.selection import selected

    text = _written(selected(table, columns or [], rows or [], order), form, width)
    return _put(text, output)


def _folder(folder: Path | None, output: Path | None) -> Path:
    if folder and output:
        raise ValueError(f"--output: expected --table, or no folder but this; got {folder} too")
    return folder or output or REPORT


def write_report(output: Path) -> int:
    """Write the report and say what it found, what is missing and where it is."""
    from plumbob.bench.report.report import write

    print_outcome(write(output))
    return SUCCESS


def _tables(folder: Path) -> list["Table"]:
    """Return the tables of a folder's records.

    Raises:
        ValueError: if there are no records.
    """
    from plumbob.bench.report.sections import tables
    from plumbob.bench.tables.results import results_of

    results, _ = results_of(folder)
    return tables(results)


def _table(folder: Path, name: str) -> "Table":
    of_name = {table.name: table for table in _tables(folder)}
    return of_name[known("table", name, of_name)]


def _list_tables(folder: Path) -> int:
    from plumbob.bench.tables.columns import text
    from plumbob.bench.tables.table import Column, Table, cells

    columns = (
        text("table", lambda table: table.name),
        text("title", lambda table: table.title),
        Column("rows", read=lambda table: len(table.rows)),
        Column("columns", read=lambda table: len(table.columns)),
    )
    print_lines(Table("tables", "", columns, cells(columns, _tables(folder))))
    return SUCCESS


def _list_columns(table: "Table") -> int:
    for number, column in enumerate(table.columns, 1):
        best, folded = f"{column.best} is best" * bool(column.best), "folded" * column.folded
        about = ", ".join(filter(None, (best, folded)))
        print(f"{number} {column.heading}" + (f" ({about})" if about else ""))
    return SUCCESS


def _written(table: "Table", form: str, width: str) -> str:
    from plumbob.bench.tables.latex import latex
    from plumbob.bench.tables.writers import comma_separated, html_fragment, markdown

    forms = {"md": markdown, "csv": comma_separated, "html": html_fragment}
    return latex(table, width) if form == "tex" else forms[form](table)


def _put(text: str, output: Path | None) -> int:
    """Write a text to standard output, or to a file."""
    from plumbob.bench.harness.record import check_regular

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
