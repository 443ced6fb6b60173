"""The command `compare`."""

import shlex
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from plumbob.text.printable import visible

from .options import (
    FAILED,
    REPORT,
    SUCCESS,
    File,
    Text,
    Texts,
    UserSolvers,
    argument,
    is_name,
    option,
    valid_name,
    writable,
    write_text,
)
from .terminal import width

if TYPE_CHECKING:
    from plumbob.bench.compare.compare import RunComparison
    from plumbob.bench.measure.record import Record


# What is measured of the user's solvers: two robots, targets of a chain, steps of a cloth.
OF_SOLVERS = ["robots/ur5", "robots/panda", "chain/", "one step/k1000"]
# Where `--save` keeps runs, below the working directory.
BASELINES = Path("plumbob_baselines")
Folders = Annotated[
    list[Path] | None, argument("[OLD NEW]", "Two folders of records, or baselines.")
]
Limits = Annotated[str, option("LIMITS", "Exit 1 beyond limits, such as solved:1,time:10%.")]
Revision = Annotated[str, option("REV", "Measure a revision in git, and the working copy.")]
Measured = Annotated[Texts, option("NAME", "With --rerun: measure this suite.", "--suite")]
Only = Annotated[Texts, option("TEXT", "Problems or solvers with this text; repeatable.")]
Pairs = Annotated[int, option("", "With --rerun: number of pairs; 0 for as many as needed.", min=0)]
Saved = Annotated[Text, option("NAME", "Keep the records of a folder under a name, and stop.")]
Markdown = Annotated[File, option("FILE", "Write a comment for a pull request.")]
Json = Annotated[File, option("FILE", "Write all rows as JSON.")]


def compare(  # noqa: PLR0913 -- one parameter an option
    folders: Folders = None,
    *,
    fail: Limits = "",
    rerun: Revision = "",
    user_solvers: UserSolvers = None,
    suites: Measured = None,
    only: Only = None,
    pairs: Pairs = 0,
    save: Saved = None,
    markdown: Markdown = None,
    json: Json = None,
) -> int:
    """Compare two runs or revisions: faster, slower, more or less accurate.

    Answers are compared bit by bit, times by confidence intervals. Differences within the drift of
    the machine are undecided; --rerun REV decides them. Exit code 1 if a row exceeds a limit of
    --fail. Rows that are gone or have failed exceed every limit, except with gone:any. With --with,
    REV is a revision of your own repository, and --fail has default limits.
    """
    from plumbob.bench.compare import compare as comparison
    from plumbob.bench.tables.writers import markdown as as_markdown

    paths = list(folders or [])
    if save is not None:
        return _save(save, paths)
    limits = comparison.gate_limits(fail or comparison.OF_SOLVERS * bool(user_solvers))
    if rerun and not paths:
        rows = _side_by_side(rerun, user_solvers or [], suites or [], only or [], pairs)
        old, new = rerun, "the working copy"
    elif len(paths) == 2 and not rerun:
        before, after = map(_records, paths)
        rows = comparison.compare(before, after, not {"solved", "error"}.isdisjoint(limits))
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


def _records(folder: Path) -> "list[Record]":
    """Return the records of a folder, or of the baseline of its name."""
    from plumbob.bench.measure.record import on_record

    is_baseline = not folder.exists() and (BASELINES / folder).is_dir()
    return on_record(BASELINES / folder if is_baseline else folder, typed=False).records


def _save(name: str, folders: list[Path]) -> int:
    """Keep the records of a folder as a baseline, in place of one of the same name."""
    from plumbob.bench.measure.folder_lock import locked
    from plumbob.bench.measure.record import RecordFile

    if not is_name(name) or name == ".." or name[0] == "-" or Path(name).name != name:
        expectation = "a name without folders or control characters"
        raise ValueError(f"--save: expected {expectation}, got {name!r}")
    if len(folders) > 1:
        raise ValueError(f"--save: expected one folder, got {len(folders)}")
    records, target = _records(*folders or [REPORT]), BASELINES / name
    writable(target)
    with locked(target):
        RecordFile(target).replace(records)
    old = shlex.quote(str(target) if Path(name).exists() else name)
    message = f"{len(records):,} records kept in {target}"
    print(visible(f"{message}; plumbob compare {old} NEW compares."))
    return SUCCESS


def _side_by_side(
    revision: str, solvers: list[str], suites: list[str], words: list[str], pairs: int
) -> "RunComparison":
    from plumbob.bench.compare.rerun import Plan, rerun
    from plumbob.bench.experiments import SUITES

    names = suites or (["ik", "cloth"] if solvers else ["timing"])
    names = [valid_name("suite", name, SUITES) for name in names]
    words = words or (OF_SOLVERS if solvers else [])
    tell = partial(print, "plumbob:", file=sys.stderr, flush=True)
    plan = Plan(revision, tuple(names), tuple(words), pairs, solvers=tuple(solvers))
    return rerun(plan, Path.cwd(), tell)
