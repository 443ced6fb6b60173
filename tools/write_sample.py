"""Write docs/sample and the README's table of the best from records: `write_sample.py FOLDER`.

The records are those of `plumbob bench --quick` with every peer; `make sample` does both.
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from plumbob.bench.measure.record import FILE_NAME, RecordFile
from plumbob.bench.page.report import BenchReport, write
from plumbob.bench.tables.layout import provenance
from plumbob.bench.tables.results import listed
from plumbob.bench.tables.table import words

DOCS = Path(__file__).parents[1] / "docs"
SAMPLE, README, CHART = DOCS / "sample", DOCS.parent / "README.md", DOCS / "best.svg"
PAGE, HEADLINES, FIGURE = "index.html", "headlines.md", "group_budget_restarts.svg"
BEGIN = "<!-- Written by tools/write_sample.py: who is best in docs/sample. -->"
FILES = re.compile(r'\s*<a href="(?:tables|figures)/[^>]*>[^<]*</a>')  # left out of the sample
END = "<!-- The end of what tools/write_sample.py writes. -->"


def write_sample(folder: Path) -> None:
    """Write the page, the headlines and the chart of a folder's records."""
    with tempfile.TemporaryDirectory() as temporary:
        shutil.copy(folder / FILE_NAME, temporary)
        report = write(Path(temporary))
        shutil.rmtree(SAMPLE, ignore_errors=True)
        SAMPLE.mkdir()
        page = (Path(temporary) / PAGE).read_text(encoding="utf-8")
        (SAMPLE / PAGE).write_text(FILES.sub("", page), encoding="utf-8")
        figure = Path(temporary) / "figures" / FIGURE
        if figure.exists():
            shutil.copy(figure, CHART)
    text = headlines(report, folder)
    (SAMPLE / HEADLINES).write_text(text, encoding="utf-8")
    readme = with_headlines(README.read_text(encoding="utf-8"), without_tuning(text))
    README.write_text(readme, encoding="utf-8")


def headlines(report: BenchReport, folder: Path) -> str:
    """Return the headlines as a Markdown table, with the machine and the versions below it."""
    rows = ["| question | answer |", "|---|---|"]
    if verdict := report.answers.verdict:
        rows.append(
            f"| Is the reference right? | {verdict.holding} of {verdict.total} claims hold; "
            f"the largest difference uses {words(100 * verdict.used)} % of its tolerance. |"
        )
    question = ""
    for line in (*report.answers.headlines, *report.answers.wins):
        rows.append(f"| {line.question if line.question != question else ''} | {line.sentence} |")
        question = line.question
    timing = [record for record in RecordFile(folder).read().records if record.suite == "timing"]
    absent = f"Absent: {listed(report.answers.absent)}. " if report.answers.absent else ""
    source = f"{report.answers.scale}; {provenance(timing)}.".lstrip("; ")
    return "\n".join([*rows, "", absent + source, ""])


def without_tuning(text: str) -> str:
    """Return the headlines without those of the robots that settings were tuned on."""
    return "".join(
        line for line in text.splitlines(keepends=True) if not re.search(r"\btuning\b", line)
    )


def with_headlines(text: str, lines: str) -> str:
    """Return a text with the headlines between the two marks.

    Raises:
        ValueError: if the marks are not there.
    """
    pattern = re.compile(f"{re.escape(BEGIN)}\n.*?{re.escape(END)}", re.DOTALL)
    if not pattern.search(text):
        raise ValueError(f"README: expected the marks {BEGIN!r} and {END!r}, got none")
    return pattern.sub(lambda _: f"{BEGIN}\n\n{lines}\n{END}", text)


if __name__ == "__main__":
    write_sample(Path(sys.argv[1]))
