"""The commands `compare` and `history`."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..help_text import block
from ..terminal import print_aligned, width
from .options import FAILED, SUCCESS, File, Texts, argument, option, valid_name, write_text

if TYPE_CHECKING:
    from plumbob.bench.comparison.compare import RunComparison

COMPARE_EXAMPLES = block(
    "Examples",
    ("plumbob compare before after", "two folders of records"),
    "plumbob compare before after --fail accuracy,time:10% --markdown comment.md",
    ("plumbob compare --rerun main --only ccd", "two revisions side by side"),
)
HISTORY_EXAMPLES = block(
    "Examples",
    ("plumbob history runs/*", "times, the largest change first"),
    "plumbob history runs/* --only ccd --quantity iterations -o iterations.svg",
)


def compare(
    folders: Annotated[list[Path] | None, argument("[OLD NEW]", "Two folders of records.")] = None,
    *,
    fail: Annotated[
        str,
        option("LIMITS", "Exit 1 beyond limits, such as accuracy,time:10%,gone."),
    ] = "",
    rerun: Annotated[
        str, option("REV", "Measure a revision, in a clone, and the working copy.")
    ] = "",
    suites: Annotated[Texts, option("NAME", "With --rerun: measure this suite.", "--suite")] = None,
    only: Annotated[
        Texts, option("TEXT", "With --rerun: problems or solvers with this text.")
    ] = None,
    pairs: Annotated[
        int, option("", "With --rerun: number of pairs; 0 for as many as needed.", min=0)
    ] = 0,
    markdown: Annotated[File, option("FILE", "Write a comment for a pull request.")] = None,
    json: Annotated[File, option("FILE", "Write all rows as JSON.")] = None,
) -> int:
    """Compare two runs or revisions: faster, slower, more or less accurate.

    Answers are compared bit by bit, times by confidence intervals. Differences within the drift of
    the machine are undecided; --rerun REV decides them. Exit code 1 if a row fails --fail.
    """
    from plumbob.bench.comparison import compare as comparison
    from plumbob.bench.harness.record import on_record
    from plumbob.bench.tables.writers import markdown as as_markdown

    limits = comparison.gate_limits(fail)
    paths = list(folders or [])
    if rerun and not paths:
        rows = _side_by_side(rerun, suites or ["timing"], only or [], pairs)
        old, new = rerun, "the working copy"
    elif len(paths) == 2 and not rerun:
        rows = comparison.compare(*(on_record(folder, typed=False).records for folder in paths))
        old, new = map(str, paths)
    else:
        got = f"{len(paths)} folder{'' if len(paths) == 1 else 's'}"
        raise ValueError(f"compare: expected OLD and NEW, or --rerun REV, got {got}")
    failed = comparison.failing(rows.rows, limits)
    print("\n".join(comparison.summary(rows, failed, width())))
    if markdown:
        write_text(markdown, as_markdown(comparison.table(rows, failed, old, new)))
    if json:
        write_text(json, comparison.as_json(rows, failed, old, new))
    return FAILED if failed else SUCCESS


def _side_by_side(
    revision: str, suites: list[str], words: list[str], pairs: int
) -> "RunComparison":
    from plumbob.bench.comparison.rerun import Plan, clone_root, rerun
    from plumbob.bench.experiments import SUITES

    names = tuple(valid_name("suite", name, SUITES) for name in suites)
    tell = partial(print, "plumbob:", file=sys.stderr, flush=True)
    return rerun(Plan(revision, names, tuple(words), pairs), clone_root(Path.cwd()), tell)


def history(
    folders: Annotated[list[Path], argument("FOLDER...", "Folders of records.")],
    *,
    quantity: Annotated[
        str, option("NAME", "Quantity of the records, such as iterations.")
    ] = "seconds",
    only: Annotated[
        Texts, option("TEXT", "Problems or solvers with this text; repeatable.")
    ] = None,
    output: Annotated[File, option("FILE", "Write a figure, an .svg.", "--output", "-o")] = None,
) -> int:
    """Show a quantity over many runs, the largest change first."""
    from plumbob.bench.comparison import history as course

    if output and output.suffix != ".svg":
        raise ValueError(f"--output: expected a file that ends with .svg, got {output}")
    runs = course.read_runs(folders)
    rows = course.courses(runs, quantity, only or [])
    print_aligned(course.table(runs, rows, quantity))
    if output:
        write_text(output, course.draw(runs, rows, quantity))
    return SUCCESS
