"""The commands `compare` and `history`."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..help_text import block
from ..terminal import print_aligned, width
from .options import MISSED, SUCCESS, known

if TYPE_CHECKING:
    from plumbob.bench.comparison.compare import RunComparison

_File = Path | None
_Words = list[str] | None
Folders = Annotated[
    list[Path] | None, typer.Argument(metavar="[OLD NEW]", help="Two folders with records.")
]
Fail = Annotated[
    str, typer.Option(metavar="LIMITS", help="Exit 1 beyond these: accuracy,time:10%,gone.")
]
Rerun = Annotated[
    str,
    typer.Option(metavar="REV", help="In a clone of Plumbob, measure this revision beside ours."),
]
Suites = Annotated[_Words, typer.Option("--suite", help="With --rerun: only these suites.")]
Only = Annotated[
    _Words,
    typer.Option(metavar="TEXT", help="With --rerun: problems or solvers that contain it."),
]
Pairs = Annotated[
    int, typer.Option(min=0, help="With --rerun: pairs of each; 0 for as many as rows need.")
]
Markdown = Annotated[
    _File, typer.Option(metavar="FILE", help="Write a comment for a pull request.")
]
Json = Annotated[_File, typer.Option(metavar="FILE", help="Write every row.")]


def compare(
    folders: Folders = None,
    fail: Fail = "",
    rerun: Rerun = "",
    suites: Suites = None,
    only: Only = None,
    pairs: Pairs = 0,
    markdown: Markdown = None,
    json: Json = None,
) -> int:
    """Say what got faster, slower, more or less right between two runs or revisions.

    Answers are compared to the bit, times by intervals. What lies within the machine's drift is
    undecided; --rerun REV decides it. Exit code 1 if --fail stops at a row.
    """
    from plumbob.bench.comparison import compare as comparison

    limit = comparison.gate_limits(fail)
    two = list(folders or [])
    if rerun and not two:
        made = _side_by_side(rerun, suites or ["timing"], only or [], pairs)
        old, new = rerun, "the working copy"
    elif len(two) == 2 and not rerun:
        made = _of_folders(*two)
        old, new = map(str, two)
    else:
        raise ValueError(f"compare: expected OLD and NEW, or --rerun REV, got {len(two)} folders")
    stopped = comparison.failing(made.rows, limit)
    print("\n".join(comparison.summary(made, stopped, width())))
    if markdown:
        from plumbob.bench.tables import writers

        _write(markdown, writers.markdown(comparison.table(made, stopped, old, new)))
    if json:
        _write(json, comparison.as_json(made, stopped, old, new))
    return MISSED if stopped else SUCCESS


COMPARE_EXAMPLES = block(
    "Examples",
    "plumbob compare before after                     two folders of records",
    "plumbob compare before after --fail accuracy,time:10% --markdown comment.md",
    "plumbob compare --rerun main --only ccd          measured side by side, in a clone",
)


def _of_folders(old: Path, new: Path) -> "RunComparison":
    from plumbob.bench.comparison.compare import compare as compare_records
    from plumbob.bench.harness.record import on_record

    return compare_records(*(on_record(folder, typed=False).records for folder in (old, new)))


def _side_by_side(
    revision: str, suites: list[str], words: list[str], pairs: int
) -> "RunComparison":
    from plumbob.bench.comparison.rerun import Plan, clone_root, rerun
    from plumbob.bench.experiments import SUITES

    plan = Plan(
        revision, tuple(known("suite", name, SUITES) for name in suites), tuple(words), pairs
    )
    return rerun(
        plan, clone_root(Path.cwd()), partial(print, "plumbob:", file=sys.stderr, flush=True)
    )


def history(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Folders of records.")],
    quantity: Annotated[str, typer.Option(help="An array of the records.")] = "seconds",
    only: Annotated[
        list[str] | None, typer.Option(metavar="TEXT", help="Problems or solvers that contain it.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Draw it: an .svg.")
    ] = None,
) -> int:
    """Show a quantity over many runs, the greatest change first."""
    from plumbob.bench.comparison import history as past

    if output and output.suffix != ".svg":
        raise ValueError(f"--output: expected a file that ends with .svg, got {output}")
    runs = past.read_runs(folders)
    made = past.courses(runs, quantity, only or [])
    print_aligned(past.table(runs, made, quantity))
    if output:
        _write(output, past.draw(runs, made, quantity))
    return SUCCESS


HISTORY_EXAMPLES = block(
    "Examples",
    "plumbob history runs/*                           times, the greatest change first",
    "plumbob history runs/* --only ccd --quantity iterations -o iterations.svg",
)


def _write(path: Path, text: str) -> None:
    from plumbob.bench.harness.record import check_regular

    check_regular(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
