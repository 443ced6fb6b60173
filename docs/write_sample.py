"""Write docs/sample and the README's headlines from records: `python docs/write_sample.py FOLDER`.

The records are those of `plumbob bench --quick` with every peer (`make sample` does all).
"""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from plumbob.bench.harness.record import FILE_NAME, RecordFile
from plumbob.bench.report.headlines import Headline
from plumbob.bench.report.report import Report, write
from plumbob.bench.tables.layout import provenance
from plumbob.bench.tables.results import listed
from plumbob.bench.tables.table import words

DOCS = Path(__file__).parent
SAMPLE, README = DOCS / "sample", DOCS.parent / "README.md"
HEADLINES = "headlines.md"
BEGIN = "<!-- Written by docs/write_sample.py: the headlines of docs/sample. -->"
END = "<!-- The end of what docs/write_sample.py writes. -->"


def write_sample(folder: Path) -> None:
    """Write the page, tables, figures and headlines of a folder's records, without these."""
    with tempfile.TemporaryDirectory() as made:
        shutil.copy(folder / FILE_NAME, made)
        written = write(Path(made))
        shutil.rmtree(SAMPLE, ignore_errors=True)
        shutil.copytree(made, SAMPLE, ignore=shutil.ignore_patterns("records.*"))
    text = headlines(written, folder)
    (SAMPLE / HEADLINES).write_text(text, encoding="utf-8")
    README.write_text(with_headlines(README.read_text(encoding="utf-8"), text), encoding="utf-8")


def headlines(written: Report, folder: Path) -> str:
    """Return the headlines in Markdown, with what they come from."""
    verdict = written.answers.verdict
    right = (
        [f"- Right: {verdict.holding} of {verdict.total} claims hold; the narrowest uses "
         f"{words(100 * verdict.used)} % of its tolerance."]
        if verdict
        else []
    )  # fmt: skip
    lines = [*right, *map(_line, written.answers.headlines)]
    absent = written.answers.absent
    lines.append(f"- Absent: {listed(absent)}." if absent else "- Every peer took part.")
    made = [record for record in RecordFile(folder).read().records if record.suite == "timing"]
    scale = written.answers.scale
    return "\n".join([*lines, "", f"{scale}; {provenance(made)}.".lstrip("; "), ""])


def _line(headline: Headline) -> str:
    question = headline.question[:1].lower() + headline.question[1:]
    return (
        f"- {headline.chapter.capitalize()}, {question}: **{headline.answer}**, {headline.detail} "
        f"([table](docs/sample/tables/{headline.table}.md))."
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
