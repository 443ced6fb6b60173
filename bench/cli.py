"""The command line. Engines, the reference and matplotlib are imported inside the commands."""

import difflib
import os
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import compile_notice, records_command
from .comparison import command as comparison
from .experiments import SUITES
from .harness.progress import listening
from .help_text import block as _block
from .presentation.text import visible
from .verify import command as verify_command

if TYPE_CHECKING:
    from .presentation.tables import Table

# The width of the names of suites in the help.
INDENT = 2 + max(map(len, SUITES))
QUICK, FULL = "quick", "full"
REPORT = Path("report")
SUCCESS, MISSED, MISUSED, INTERRUPTED, UNREAD = 0, 1, 2, 130, 141
_UsageError: Any = typer.BadParameter.__base__

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


Output = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of records and report.")
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Forget what is on record; measure anew.")]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code.

    A reader that has seen enough, such as `head`, ends the program without a word. The signal for
    it stays ignored: it would also strike where a worker has ended that we are writing to.
    """
    try:
        code = run_command(arguments)
        sys.stdout.flush()
    except BrokenPipeError:
        code = UNREAD
    if code == UNREAD:  # what is not yet written has nowhere to go
        for stream in (sys.stdout, sys.stderr):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    sys.exit(code)


def run_command(arguments: Sequence[str] | None = None) -> int:
    """Return the exit code.

    0 success, 1 a check failed, 2 bad usage or input, 130 interrupted, 141 nobody reads the output.
    """
    try:
        code = app(arguments, prog_name="plumbob", standalone_mode=False)
        if code == INTERRUPTED:  # typer's own answer to Ctrl-C
            raise KeyboardInterrupt
        return code if isinstance(code, int) else SUCCESS
    except (KeyboardInterrupt, typer.Abort):
        print("plumbob: interrupted; what was finished is on record", file=sys.stderr)
        return INTERRUPTED
    except _UsageError as error:
        return _complain(error.format_message())
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):  # typer's own answer to that
            return UNREAD
        raise
    except BrokenPipeError:
        return UNREAD
    except OSError as error:
        return _complain(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "))
    except ValueError as error:
        return _complain(str(error))


@app.callback(
    invoke_without_command=True,
    epilog=_block(
        "Examples",
        "plumbob verify my_solver.py    is your solver right, and if not, why?",
        "plumbob                        the main job",
        "plumbob check                  is the reference right?",
        "plumbob bench ik cloth         measure two suites at full length",
        "plumbob report                 write the report again from the records",
        "plumbob show cloth             an animation of the falling cloth",
    ),
)
def plumbob(
    context: typer.Context,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Folder to write to, else report."),
    ] = None,
    fresh: Fresh = False,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> int:
    """Validate, measure and report: skeleton kinematics and implicit mass-spring dynamics.

    Without a command it does the main job: check the reference against Pinocchio and MuJoCo, run
    the quick bench, and write report/index.html, in a few minutes.
    """
    if version:
        import importlib.metadata

        print(f"plumbob {importlib.metadata.version('plumbob')}")
        raise typer.Exit
    if sys.stderr.isatty():
        compile_notice.install()
    if context.invoked_subcommand is not None:
        if output or fresh:
            raise ValueError(f"write options behind the command: {context.invoked_subcommand}")
        return SUCCESS
    return main_job(output or REPORT, fresh)


app.command(cls=verify_command.SolverCommand, epilog=_block("Examples", *verify_command.EXAMPLES))(
    verify_command.verify
)


@app.command(
    epilog=_block(
        "Examples",
        "plumbob check",
        'plumbob check "spring forces" "Gauss-Newton step"',
        "plumbob check --files robots/  your URDF, MJCF and BVH files: who reads them, who agrees",
    )
)
def check(
    claims: Annotated[
        list[str] | None,
        typer.Argument(metavar="CLAIM", help="Only these; see --list. With --files, paths."),
    ] = None,
    names: Annotated[bool, typer.Option("--list", help="List the claims and stop.")] = False,
    files: Annotated[
        bool, typer.Option("--files", help="Read files and folders of files with both engines.")
    ] = False,
) -> int:
    """Hold the reference against Pinocchio and MuJoCo: a verdict table, exit 1 on a miss."""
    if files:
        return check_files(claims or [])
    from crosscheck.claims import CLAIMS, run_claims
    from crosscheck.robots.models import left_out

    if names:
        for claim in CLAIMS.values():
            print(f"{claim.name}: {claim.ours}, against {claim.theirs}")
        return SUCCESS
    chosen = [_known("claim", name, CLAIMS) for name in claims or CLAIMS]
    with progress() as bar:
        task = bar.add_task("", total=len(chosen))
        verdicts = run_claims(
            chosen, lambda claim: bar.update(task, description=claim.name, advance=1)
        )
    print_verdicts(verdicts)
    if missing := left_out():
        print(missing)
    return SUCCESS if all(verdict.holds for verdict in verdicts) else MISSED


@app.command(
    epilog=_block(
        "Examples",
        "plumbob bench                  everything, at full length",
        "plumbob bench --quick timing   one suite, quickly",
        "plumbob bench cloth --fresh    forget the cloth's records and measure anew",
    )
    + "\n\n"
    + _block("Suites", *(f"{name:<{INDENT}}{about}" for name, about in SUITES.items()))
)
def bench(
    suites: Annotated[
        list[str] | None, typer.Argument(metavar="SUITE", help="Suites to run; all if none.")
    ] = None,
    output: Output = REPORT,
    fresh: Fresh = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer targets, shorter timing.")] = False,
) -> int:
    """Measure problems with solvers. What is on record is kept, so a run can be taken up again."""
    chosen = tuple(dict.fromkeys(_known("suite", name, SUITES) for name in suites or SUITES))
    writable(output)
    code = run_suites(chosen, QUICK if quick else FULL, output, fresh)
    if suites:
        print_tables(chosen, output)
    return code


@app.command(epilog=_block("Examples", "plumbob report", "plumbob report --output results/laptop"))
def report(output: Output = REPORT) -> int:
    """Write tables (Markdown, LaTeX, CSV), figures and one offline page from the records."""
    return write_report(output)


@app.command(
    epilog=_block(
        "Examples",
        "plumbob show arm",
        "plumbob show heart --solver fabrik",
        "plumbob show star --output star.svg",
        "plumbob show heart --coherent --output heart.bvh",
    )
)
def show(
    scene: Annotated[
        str, typer.Argument(metavar="SCENE", help="arm, cloth, or a curve that the arm draws.")
    ],
    file: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="A .gif, .svg or .bvh.")
    ] = None,
    solver: Annotated[
        str | None, typer.Option(help="For an arm fabrik, ccd, ...; for the cloth newton, ...")
    ] = None,
    coherent: Annotated[
        bool, typer.Option("--coherent", help="Let the arm move as smoothly as it can, in a loop.")
    ] = False,
) -> int:
    """Write an animation (GIF) or a picture (SVG) of the arm drawing a curve, or of the cloth.

    The arm's motion can also be written as BVH, which animation programs open.
    """
    from .harness.record import check_regular
    from .show import SCENES, write

    _known("scene", scene, SCENES)
    path = file or REPORT / f"{scene}.gif"
    check_regular(path)
    writable(path.parent)
    with progress() as bar:
        task = bar.add_task(scene, total=None)
        drawn = partial(_drawn, bar, task)
        write(scene, path, solver, drawn, coherent)
    print(visible(str(path)))
    return SUCCESS


def _drawn(bar: Any, task: Any, done: int, total: int) -> None:
    bar.update(task, completed=done, total=total)


app.command(epilog=comparison.COMPARE_EXAMPLES)(comparison.compare)
app.command(epilog=comparison.HISTORY_EXAMPLES)(comparison.history)
app.add_typer(records_command.app, name="records")


def main_job(output: Path, fresh: bool) -> int:
    """Say what comes, then check, measure quickly and report."""
    print(
        "Plumbob checks its reference against Pinocchio and MuJoCo, measures every suite quickly\n"
        f"and writes {output / 'index.html'}. That takes a few minutes, compilation included;\n"
        f"what {output} has on record already is kept. Other commands: plumbob --help\n",
        flush=True,
    )
    writable(output)
    failed = run_suites(tuple(SUITES), QUICK, output, fresh)
    return max(failed, write_report(output))


def run_suites(suites: Sequence[str], scale: str, output: Path, fresh: bool) -> int:
    """Run suites with a progress bar; return 1 if a claim is missed or a block failed."""
    from .harness import run
    from .harness.record import RecordFile

    RecordFile(output).read()  # before anything is measured that could not be kept
    if fresh:
        run.forget(suites, scale, output)
    done, failures = {run.KEPT: 0, run.MEASURED: 0, run.FAILED: 0}, []
    not_run: list[str] = []
    again: Counter[str] = Counter()
    with progress() as bar:
        task = bar.add_task("starting", total=run.count(suites, scale))
        with listening(lambda progress: bar.update(task, description=visible(progress.what))):
            for event in run.run(suites, scale, output):
                bar.update(task, description=visible(f"{event.suite}: {event.what}"))
                if event.state in done:
                    done[event.state] += 1
                    bar.advance(task)
                if event.state == run.MEASURING and event.message:
                    again[event.message] += 1
                if event.state == run.NOT_RUN:
                    not_run.append(f"{event.suite}: {event.message}")
                if event.state == run.FAILED:
                    failures.append(f"{event.suite}: {event.what}: {event.message}")
    kept = visible(f"{done[run.KEPT]} kept as on record, in {output}")
    print(f"{done[run.MEASURED]} measured, {kept}")
    for sentence in (*(f"measured again: {n}, for {why}" for why, n in again.items()), *not_run):
        print(visible(sentence))
    if warning := RecordFile(output).read().warning:
        print(f"plumbob: {visible(warning)}", file=sys.stderr)
    for failure in [*failures, *run.missed_claims(suites, output)]:
        print(f"plumbob: {visible(failure)}", file=sys.stderr)
        done[run.FAILED] += 1
    return MISSED if done[run.FAILED] else SUCCESS


def write_report(output: Path) -> int:
    """Write the report and say where it is, what it found and what is missing."""
    from .presentation.report import write

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


def check_files(paths: Sequence[str]) -> int:
    """Compare every URDF, MJCF and BVH file at some paths; return 1 if a reading disagrees."""
    if not paths:
        raise ValueError("--files: expected folders or files, got none")
    from crosscheck.robots.files import check, find

    from .experiments.check.files import report

    found = find(paths)
    checked = []
    with progress() as bar:
        task = bar.add_task("", total=len(found.files))
        for one in check(found.files):
            checked.append(one)
            bar.update(task, description=one.file.path.name, advance=1)
    files, summary, disagreements = report(found, checked)
    for table in (files, summary):
        print_table(table)
    return MISSED if disagreements else SUCCESS


def print_table(table: "Table") -> None:
    """Print a table with what it says: aligned on a terminal, as Markdown in a pipe."""
    from .presentation.tables import markdown

    if sys.stdout.isatty():
        print_aligned(table)
    else:
        print(markdown(table))


def print_tables(suites: Sequence[str], output: Path) -> None:
    """Print the tables that come from these suites, with what they say."""
    from .harness.record import RecordFile
    from .presentation.results import Results, plain, sift
    from .presentation.sections import tables

    records = [plain(record) for record in RecordFile(output).read().records]
    records, _ = sift(lambda results: tables(results, suites), records)
    for made in tables(Results(records), suites):
        if made.rows:
            print_aligned(made)


def print_summary(table: "Table") -> None:
    """Print what a table is called and says."""
    print(f"\n{table.title}\n  {table.summary.sentence}".rstrip())
    print("".join(f"    {point}\n" for point in table.summary.points), end="", flush=True)


def print_aligned(table: "Table") -> None:
    """Print a table with what it says; as wide as the terminal, or very wide in a pipe."""
    print_summary(table)
    _print(_aligned(table), 240)


def _print(shown: Any, width: int) -> None:
    from rich.console import Console

    Console(
        width=None if sys.stdout.isatty() else width, highlight=False, markup=False, emoji=False
    ).print(shown)


def _aligned(table: "Table") -> Any:
    """Return a table as rich prints it, rows that miss something in red."""
    import rich.table
    from rich.text import Text

    from .presentation.tables import words

    shown = rich.table.Table(box=None, header_style="bold", pad_edge=False)
    for column in table.columns:
        shown.add_column(column.heading, justify="left" if column.words else "right")
    for row in table.rows:
        missed = any(str(cell).startswith("MISSED") for cell in row)
        shown.add_row(*(Text(words(cell)) for cell in row), style="bold red" if missed else None)
    return shown


def print_verdicts(verdicts: Sequence[Any]) -> None:
    """Print the table of verdicts."""
    from .presentation.tables import Column, Table

    words = {name: Column(name, words=True) for name in ("claim", "verdict")}
    numbers = map(Column, ("cases", "largest difference", "tolerance"))
    rows = [
        (
            verdict.claim.name,
            verdict.cases,
            verdict.difference,
            verdict.claim.tolerance.value,
            "held" if verdict.holds else f"MISSED: {verdict.failure}",
        )
        for verdict in verdicts
    ]
    table = Table("verdicts", "", (words["claim"], *numbers, words["verdict"]), tuple(rows))
    _print(_aligned(table), 120)
    print(f"{sum(verdict.holds for verdict in verdicts)} of {len(rows)} claims held")


def progress() -> Any:
    """Return a progress bar on a terminal, and nothing to see in a pipe."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    text = TextColumn("{task.description}", markup=False)
    return Progress(
        *(BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn(), text),
        console=Console(stderr=True),
        transient=True,
        refresh_per_second=2,
        disable=not sys.stderr.isatty(),
    )


def writable(folder: Path) -> None:
    """Make the folder if need be.

    Raises:
        OSError: naming it, if nothing can be written there.
        ValueError: if it is something else than a folder.
    """
    import tempfile

    from .harness.record import check_folder

    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(error.errno, "cannot write here", str(folder)) from None


def _known(kind: str, name: str, valid: Iterable[str]) -> str:
    names = list(valid)
    if name in names:
        return name
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(names)}"
    raise ValueError(f"unknown {kind} {name!r}: {hint}")


def _complain(message: str) -> int:
    print(f"plumbob: {visible(message)}", file=sys.stderr)
    return MISUSED
