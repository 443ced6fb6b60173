"""The command `bench`, which measures, and the main job, which measures and reports."""

import re
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from plumbob.bench.experiments import EXPERIMENTS, SUITES
from plumbob.bench.measure.compile_ahead import compiling_ahead
from plumbob.bench.measure.progress import TROUBLE, Progress, listening
from plumbob.text.printable import visible

from . import terminal
from .help_text import fitted
from .options import (
    FAILED,
    REPORT,
    SUCCESS,
    Fresh,
    Output,
    Text,
    Texts,
    UserSolvers,
    argument,
    flag,
    option,
    valid_name,
    writable,
)
from .report import write_report
from .verify import program_of

if TYPE_CHECKING:
    from plumbob.bench.measure.block import Choice
    from plumbob.bench.measure.executors import Executor
    from plumbob.bench.measure.run import Event

QUICK, FULL = "quick", "full"
TIMED_SUITES = {experiment.suite for experiment in EXPERIMENTS if experiment.times}
# Kernels are compiled ahead while suites without times are measured.
MAIN_SUITES = sorted(SUITES, key=TIMED_SUITES.__contains__)
# Between the columns of a line.
_GAP = re.compile(r"( {2,})")


Suites = Annotated[Texts, argument("SUITE", "Suites to measure; all if none.")]
Quick = Annotated[bool, flag("Measure fewer targets and rounds.", "--quick")]
Solvers = Annotated[Texts, option("NAME", "Measure only this solver; repeatable.")]
Problems = Annotated[Texts, option("NAME", "Only this problem, or your .py, model or folder.")]
Robots = Annotated[Texts, option("NAME", "Measure only this robot; repeatable.")]
Targets = Annotated[
    int | None, option("N", "Targets per problem; 1/20 per kind for robots.", min=1)
]
Seed = Annotated[int | None, option("N", "Seed of the random targets in suite ik.", min=0)]
Seeds = Annotated[int, option("N", "Draw targets of robots from N seeds.", min=1)]
Effector = Annotated[Text, option("NAME", "Link of your models that must reach the target.")]
Listing = Annotated[bool, flag("List problems and solvers, and stop.", "--list")]
DryRun = Annotated[bool, flag("List what would be measured, and stop.", "--dry-run")]
Verbose = Annotated[bool, flag("Print every table as well.", "--verbose")]
Address = Annotated[str, option("local|dask://HOST:PORT", "Where to measure; see docs/cluster.md.")]


def bench(  # noqa: PLR0913 -- one parameter an option
    context: typer.Context,
    suites: Suites = None,
    *,
    output: Output = REPORT,
    fresh: Fresh = False,
    quick: Quick = False,
    user_solvers: UserSolvers = None,
    solver: Solvers = None,
    problem: Problems = None,
    robot: Robots = None,
    targets: Targets = None,
    seed: Seed = None,
    seeds: Seeds = 1,
    effector: Effector = None,
    listing: Listing = False,
    dry: DryRun = False,
    verbose: Verbose = False,
    executor: Address = "local",
) -> int:
    """Measure problems with solvers. Records are kept, so that a run can be continued.

    Your solver is opened as by plumbob verify, and gets a row in every table of the suites ik and
    cloth. Installed packages enter solvers by the entry point plumbob.solvers.
    """
    from .selection import MeasurementRequest, choose

    names = list(dict.fromkeys(valid_name("suite", name, SUITES) for name in suites or SUITES))
    parts = (solver or (), problem or (), robot or ())
    request = MeasurementRequest(
        user_solvers or (), program_of(context), *parts, targets, seed, seeds, effector
    )
    choice = choose(names, QUICK if quick else FULL, request)
    if listing or dry:
        return _print_plan(names, choice, None if listing else output)
    return _measure(names, choice, output, fresh, executor, verbose)


def _print_plan(names: list[str], choice: "Choice", output: Path | None) -> int:
    """Print the problems and solvers, or with a folder the measurements planned there."""
    from . import plan

    lines = plan.dry_run(names, choice, output) if output else plan.listed(names, choice)
    for line in lines:
        cells = (cell if cell.isspace() else visible(cell) for cell in _GAP.split(line))
        print("\n".join(fitted("".join(cells), terminal.width())))
    return SUCCESS


def _measure(
    names: list[str],
    choice: "Choice",
    output: Path,
    fresh: bool,
    address: str,
    verbose: bool,
) -> int:
    """Measure suites and print the answer, on request after every table."""
    from plumbob.bench.measure.executors import executor_at

    writable(output)
    with closing(executor_at(address)) as place:
        code = run_suites(names, choice, output, fresh, place)
    if verbose:
        terminal.print_tables(names, output)
    terminal.print_ending(names, output)
    folder = "" if output == REPORT else f" -o {shlex.quote(str(output))}"
    tables = "" if verbose else f" `plumbob bench --verbose{folder}` prints all tables."
    terminal.print_filled(visible(f"Read on: `plumbob report{folder}` writes the page.{tables}"))
    return code


def main_job(output: Path, fresh: bool) -> int:
    """Check, measure quickly and report."""
    print(
        "Plumbob checks its reference against Pinocchio and MuJoCo, measures solvers quickly\n"
        f"and writes {output / 'index.html'}. That takes a few minutes, compilation included;\n"
        f"records in {output} are kept. Other commands: plumbob --help\n",
        flush=True,
    )
    writable(output)
    with compiling_ahead() as wait:
        code = run_suites(MAIN_SUITES, QUICK, output, fresh, before_times=wait)
    return max(code, write_report(output))


def run_suites(
    suites: Sequence[str],
    scale: "str | Choice",
    output: Path,
    fresh: bool,
    executor: "Executor | None" = None,
    before_times: Callable[[], object] = bool,
) -> int:
    """Run suites with a progress bar; return 1 if a claim is missed or a block failed.

    `before_times` is called before each block of a suite that measures times.
    """
    from plumbob.bench.measure import run
    from plumbob.bench.measure.record import RecordFile
    from plumbob.reference.backend.compilation import numba_settings

    RecordFile(output).read()  # raises before anything is measured that could not be stored
    if numba_settings().DISABLE_JIT:
        raise ValueError(
            "NUMBA_DISABLE_JIT: expected it unset where times are measured, got it set"
        )
    if fresh:
        run.forget(suites, scale, output)
    events = run_with_progress(suites, scale, output, executor, before_times)
    _print_counts(events, output)
    reasons: dict[str, list[str]] = {}
    for event in events:
        if event.state == run.FAILED:
            reasons.setdefault(event.message, []).append(f"{event.suite}: {event.subject}")
    failures = [
        f"{first}{f' and {len(more)} more' if more else ''}: {reason}"
        for reason, (first, *more) in reasons.items()
    ]
    failures += run.missed_claims(suites, output)
    for failure in failures:
        print(f"plumbob: {visible(failure)}", file=sys.stderr)
    return FAILED if failures else SUCCESS


def run_with_progress(
    suites: Sequence[str],
    scale: "str | Choice",
    output: Path,
    executor: "Executor | None" = None,
    before_times: Callable[[], object] = bool,
) -> "list[Event]":
    """Run suites with a progress bar, and return all events."""
    from plumbob.bench.measure import run
    from plumbob.bench.measure.executors import THIS_PROCESS

    events: list[Event] = []
    with terminal.progress() as bar, terminal.lines_in_a_pipe(bar):
        task, counts = bar.add_task("starting", total=run.count(suites, scale)), Counter[str]()
        is_serial = executor in (None, THIS_PROCESS)
        with listening(_listener(bar, task, events if is_serial else ())):
            for event in run.run(suites, scale, output, executor or THIS_PROCESS):
                if event.state == run.MEASURING and event.suite in TIMED_SUITES:
                    before_times()
                events.append(event)
                counts[event.state] += 1
                advance = event.state in (run.KEPT, run.MEASURED, run.FAILED)
                description = visible(f"{event.suite}: {event.subject}")
                bar.update(task, description=description, advance=advance, kept=counts[run.KEPT])
    return events


def _listener(bar: Any, task: Any, events: "Sequence[Event]") -> Callable[[Progress], None]:
    """Return a function to show progress, and to print the first failure of each solver at once.

    `events` are all events so far if blocks are measured in turn, else empty.
    """
    solvers: set[str] = set()

    def listen(step: Progress) -> None:
        if step.state != TROUBLE:
            bar.update(task, description=visible(step.subject))
        elif step.subject not in solvers:
            solvers.add(step.subject)
            place = events[-1].subject if events else step.subject
            print(visible(f"{place}: {step.message}"), file=sys.stderr, flush=True)

    return listen


def _print_counts(events: "Sequence[Event]", output: Path) -> None:
    """Print how many blocks were measured, kept, measured again, and not run."""
    from plumbob.bench.measure import run
    from plumbob.bench.measure.record import RecordFile

    counts = Counter(event.state for event in events)
    unchanged = visible(f"{counts[run.KEPT]:,} already on record in {output}")
    print(f"{counts[run.MEASURED]:,} measured, {unchanged}")
    repeats = Counter(e.message for e in events if e.state == run.MEASURING and e.message)
    for reason, count in repeats.items():
        print(visible(f"Measured again: {count:,}, for {reason}"))
    for event in events:
        if event.state == run.NOT_RUN:
            print(visible(f"{event.suite}: {event.message}"))
    if warning := RecordFile(output).read().warning:
        print(f"plumbob: {visible(warning)}", file=sys.stderr)
