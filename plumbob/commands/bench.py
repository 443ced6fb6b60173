"""The command `bench`, which measures, and the main job, which measures and reports."""

import re
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from plumbob.bench.experiments import SUITES
from plumbob.bench.harness.progress import TROUBLE, Progress, listening
from plumbob.bench.text import visible

from ..help_text import block, fitted
from ..terminal import lines_in_a_pipe, print_ending, print_tables, progress, width
from .options import MISSED, REPORT, SUCCESS, Fresh, Output, known, writable
from .report import write_report
from .verify import program_of

if TYPE_CHECKING:
    from plumbob.bench.harness.block import Choice
    from plumbob.bench.harness.executors import Executor
    from plumbob.bench.harness.run import Event

# The width of the names of suites in the help.
INDENT = 2 + max(map(len, SUITES))
QUICK, FULL = "quick", "full"
EXAMPLES = (
    block(
        "Examples",
        "plumbob bench                          everything, at full length",
        "plumbob bench --quick timing           one suite, quickly",
        "plumbob bench cloth --fresh            forget the cloth's records and measure anew",
        "plumbob bench --executor dask://node1:8786    on a cluster, see docs/cluster.md",
    )
    + "\n\n"
    + block(
        "Your solver",
        "plumbob bench ik --with my_ik.py       in every table beside ours and the peers",
        "plumbob bench cloth --with my_package.cloth:Solver",
        "plumbob bench ik --with 'Mine 2=my_ik.py' --with my_ik_before.py",
        "plumbob bench ik -- ./my_solver --flag",
    )
    + "\n\n"
    + block(
        "Your problems, and parts of the work",
        "plumbob bench ik --problem my_problems.py --problem robots/",
        "plumbob bench ik --solver 'Plumbob LM' --robot panda --targets 50",
        "plumbob bench ik --list                what there is to choose from",
        "plumbob bench --dry-run                what would be measured, and how long it takes",
    )
    + "\n\n"
    + block("Suites", *(f"{name:<{INDENT}}{about}" for name, about in SUITES.items()))
)
_Names = list[str] | None
With = Annotated[
    _Names,
    typer.Option("--with", metavar="SOLVER", help="Your my_ik.py, or module:object; repeatable."),
]
Solver = Annotated[_Names, typer.Option(metavar="NAME", help="Only this solver; repeatable.")]
Problem = Annotated[
    _Names,
    typer.Option(metavar="NAME", help="Only this one, or yours: a .py, a model, a folder."),
]
Robot = Annotated[_Names, typer.Option(metavar="NAME", help="Only this robot; repeatable.")]
Targets = Annotated[
    int | None, typer.Option(metavar="N", help="Random targets a problem; robots get a tenth.")
]
Effector = Annotated[
    str | None, typer.Option(metavar="NAME", help="Of your models, the link that is to get there.")
]
Pins = Annotated[
    str | None, typer.Option(metavar="RULE", help="Of your OBJ: far, top, or indices as 0,10.")
]
Listing = Annotated[bool, typer.Option("--list", help="List problems and solvers, and stop.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Say what would be measured, and stop.")]
Verbose = Annotated[bool, typer.Option("--verbose", help="Print every table as well.")]
Executed = Annotated[str, typer.Option(metavar="local|dask://HOST:PORT", help="Where to measure.")]
Mixed = Annotated[
    bool, typer.Option("--mix-machines", help="With Dask: let one table hold times of several.")
]


class Asked(NamedTuple):
    """What the options about solvers and problems say, as they are."""

    entered: Sequence[str] = ()
    program: Sequence[str] = ()
    solvers: Sequence[str] = ()
    problems: Sequence[str] = ()
    robots: Sequence[str] = ()
    targets: int | None = None
    effector: str | None = None
    pins: str | None = None


def bench(  # noqa: PLR0913 -- one parameter an option
    context: typer.Context,
    suites: Annotated[
        list[str] | None, typer.Argument(metavar="SUITE", help="Suites to run; all if none.")
    ] = None,
    output: Output = REPORT,
    fresh: Fresh = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer targets, shorter timing.")] = False,
    entered: With = None,
    solver: Solver = None,
    problem: Problem = None,
    robot: Robot = None,
    targets: Targets = None,
    effector: Effector = None,
    pins: Pins = None,
    listing: Listing = False,
    dry: DryRun = False,
    verbose: Verbose = False,
    executor: Executed = "local",
    mix_machines: Mixed = False,
) -> int:
    """Measure problems with solvers. What is on record is kept, so a run can be taken up again.

    A solver of yours is opened as by plumbob verify, and stands in every table of the suites ik and
    cloth under its own name. Installed packages enter solvers by the entry point plumbob.solvers.
    """
    from plumbob.bench.harness.executors import executor_at

    chosen = tuple(dict.fromkeys(known("suite", name, SUITES) for name in suites or SUITES))
    names = (solver or (), problem or (), robot or ())
    asked = Asked(entered or (), program_of(context), *names, targets, effector, pins)
    choice = _choice(chosen, QUICK if quick else FULL, asked)
    if listing or dry:
        return _look_ahead(chosen, choice, output, listing)
    writable(output)
    with closing(executor_at(executor, mix_machines)) as where:
        code = run_suites(chosen, choice, output, fresh, where)
    if verbose:
        print_tables(chosen, output)
    print_ending(chosen, output)
    folder = "" if output == REPORT else f" -o {shlex.quote(str(output))}"
    print(visible(f"All tables: this command with --verbose; page: plumbob report{folder}"))
    return code


def _choice(suites: Sequence[str], scale: str, asked: Asked) -> "Choice":
    """Return what is to be measured, after opening the solvers and problems that are entered."""
    from plumbob.bench.peers import opening
    from plumbob.bench.problems import files as problem_files

    from . import selection

    entries = opening.addresses(asked.entered, asked.program)
    entrants = opening.opened(entries, suites)
    for found in opening.opened_where_possible(opening.installed(), suites, entrants):
        if isinstance(found, str):
            print(f"plumbob: {visible(found)}", file=sys.stderr)
        else:
            entrants.append(found)
    own, names = problem_files.read(asked.problems, suites, asked.effector, asked.pins)
    made = selection.scale_of(scale, asked.targets, entrants, own)
    wanted = selection.Wanted(asked.solvers, names, asked.robots, asked.targets)
    return selection.choose(suites, scale, made, wanted)


def _look_ahead(suites: Sequence[str], choice: "Choice", output: Path, listing: bool) -> int:
    from .listing import listed
    from .outlook import dry_run

    for line in listed(suites, choice) if listing else dry_run(suites, choice, output):
        parts = (part if part.isspace() else visible(part) for part in _COLUMNS.split(line))
        print("\n".join(fitted("".join(parts), width())))
    return SUCCESS


# What stands between the columns of a line.
_COLUMNS = re.compile(r"( {2,})")


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


def run_suites(
    suites: Sequence[str],
    scale: "str | Choice",
    output: Path,
    fresh: bool,
    executor: "Executor | None" = None,
) -> int:
    """Run suites with a progress bar; return 1 if a claim is missed or a block failed."""
    from plumbob.bench.harness import run
    from plumbob.bench.harness.record import RecordFile

    RecordFile(output).read()  # before anything is measured that could not be kept
    _require_compiler()
    if fresh:
        run.forget(suites, scale, output)
    events = _run_with_progress(suites, scale, output, executor)
    _print_counts(events, output)
    failures = [*_failures(events), *run.missed_claims(suites, output)]
    for failure in failures:
        print(f"plumbob: {visible(failure)}", file=sys.stderr)
    return MISSED if failures else SUCCESS


def _require_compiler() -> None:
    from plumbob.reference.backend.compilation import numba_settings

    if numba_settings().DISABLE_JIT:
        raise ValueError("NUMBA_DISABLE_JIT: expected it unset where times are taken, got it set")


def _run_with_progress(
    suites: Sequence[str], scale: "str | Choice", output: Path, executor: "Executor | None"
) -> "list[Event]":
    from plumbob.bench.harness import run
    from plumbob.bench.harness.executors import THIS_PROCESS

    events: list[Event] = []
    with progress() as bar, lines_in_a_pipe(bar):
        task, counts = bar.add_task("starting", total=run.count(suites, scale)), Counter[str]()
        with listening(_listener(bar, task, events if executor in (None, THIS_PROCESS) else ())):
            for event in run.run(suites, scale, output, executor or THIS_PROCESS):
                events.append(event)
                counts[event.state] += 1
                advance = event.state in (run.KEPT, run.MEASURED, run.FAILED)
                description = visible(f"{event.suite}: {event.subject}")
                bar.update(task, description=description, advance=advance, kept=counts[run.KEPT])
    return events


def _print_counts(events: "Sequence[Event]", output: Path) -> None:
    """Print how much was measured and kept, and what was measured again or not at all."""
    from plumbob.bench.harness import run
    from plumbob.bench.harness.record import RecordFile

    counts = Counter(event.state for event in events)
    kept = visible(f"{counts[run.KEPT]} kept as on record, in {output}")
    print(f"{counts[run.MEASURED]} measured, {kept}")
    again = Counter(e.message for e in events if e.state == run.MEASURING and e.message)
    for reason, count in again.items():
        print(visible(f"measured again: {count}, for {reason}"))
    for event in events:
        if event.state == run.NOT_RUN:
            print(visible(f"{event.suite}: {event.message}"))
    if warning := RecordFile(output).read().warning:
        print(f"plumbob: {visible(warning)}", file=sys.stderr)


def _failures(events: "Sequence[Event]") -> list[str]:
    """Return a sentence for each reason why blocks failed."""
    from plumbob.bench.harness import run

    blocks: dict[str, list[str]] = {}
    for event in events:
        if event.state == run.FAILED:
            blocks.setdefault(event.message, []).append(f"{event.suite}: {event.subject}")
    return [
        f"{first}{f' and {len(more)} more' if more else ''}: {reason}"
        for reason, (first, *more) in blocks.items()
    ]


def _listener(bar: Any, task: Any, events: "Sequence[Event]") -> Callable[[Progress], None]:
    """Return what shows progress, and says at once that a solver gives no answer, the first time.

    `events` are those so far if blocks are measured one after the other, else none.
    """
    solvers: set[str] = set()

    def listen(progress: Progress) -> None:
        if progress.state != TROUBLE:
            bar.update(task, description=visible(progress.subject))
        elif progress.subject not in solvers:
            solvers.add(progress.subject)
            place = events[-1].subject if events else progress.subject
            print(visible(f"{place}: {progress.message}"), file=sys.stderr, flush=True)

    return listen
