"""The command `report`: write tables, figures and the page from the records."""

from pathlib import Path

from ..help_text import block
from ..presentation.text import visible
from ..terminal import print_summary
from .options import REPORT, SUCCESS, Output

EXAMPLES = block("Examples", "plumbob report", "plumbob report --output results/laptop")


def report(output: Output = REPORT) -> int:
    """Write tables (Markdown, LaTeX, CSV), figures and one offline page from the records."""
    return write_report(output)


def write_report(output: Path) -> int:
    """Write the report and say where it is, what it found and what is missing."""
    from ..presentation.report import write

    written = write(output)
    for table in written.tables:
        if table.rows:
            print_summary(table)
    print()
    for sentence in written.missing:
        print(f"Missing: {sentence}")
    page = visible(str(written.page))
    print(f"{page}: {len(written.tables)} tables, also as Markdown, LaTeX and CSV")
    return SUCCESS
