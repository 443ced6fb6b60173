"""The command `bench`, which measures, and the main job, which measures and reports."""

import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..experiments import SUITES
from ..harness.progress import listening
from ..help_text import block
from ..presentation.text import visible
from ..terminal import print_tables, progress
from .options import MISSED, REPORT, SUCCESS, Fresh, Output, known, writable
from .report import write_report

if TYPE_CHECKING:
    from ..harness.executor import Executor

# The width of the names of suites in the help.
INDENT = 2 + max(map(len, SUITES))
QUICK, FULL = "quick", "full"
EXAMPLES = (
    block(
        "Examples",
        "plumbob bench                  everything, at full length",
        "plumbob bench --quick timing   one suite, quickly",
        "plumbob bench cloth --fresh    forget the cloth's records and measure anew",
        "plumbob bench --executor dask://node1:8786    on a cluster, see docs/cluster.md",
    )
    + "\n\n"
    + block("Suites", *(f"{name:<{INDENT}}{about}" for name, about in SUITES.items()))
)


def bench(
    suites: Annotated[
        list[str] | None, typer.Argument(metavar="SUITE", help="Suites to run; all if none.")
    ] = None,
    output: Output = REPORT,
    fresh: Fresh = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer targets, shorter timing.")] = False,
    executor: Annotated[
        str, typer.Option(metavar="local|dask://HOST:PORT", help="Where to measure.")
    ] = "local",
    mix_machines: Annotated[
        bool, typer.Option("--mix-machines", help="With Dask: let one table hold times of several.")
    ] = False,
) -> int:
    """Measure problems with solvers. What is on record is kept, so a run can be taken up again."""
    from ..executors import executor_at

    chosen = tuple(dict.fromkeys(known("suite", name, SUITES) for name in suites or SUITES))
    writable(output)
    with closing(executor_at(executor, mix_machines)) as where:
        code = run_suites(chosen, QUICK if quick else FULL, output, fresh, where)
    if suites:
        print_tables(chosen, output)
    return code


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
    scale: str,
    output: Path,
    fresh: bool,
    executor: "Executor | None" = None,
) -> int:
    """Run suites with a progress bar; return 1 if a claim is missed or a block failed."""
    from ..harness import run
    from ..harness.executor import HERE
    from ..harness.record import RecordFile

    RecordFile(output).read()  # before anything is measured that could not be kept
    if fresh:
        run.forget(suites, scale, output)
    done, failures = {run.KEPT: 0, run.MEASURED: 0, run.FAILED: 0}, []
    not_run: list[str] = []
    again: Counter[str] = Counter()
    with progress() as bar:
        task = bar.add_task("starting", total=run.count(suites, scale))
        with listening(lambda progress: bar.update(task, description=visible(progress.what))):
            for event in run.run(suites, scale, output, executor or HERE):
                bar.update(task, description=visible(f"{event.suite}: {event.what}"))
                if event.state in done:
                    done[event.state] += 1
                    bar.update(task, advance=1, kept=done[run.KEPT])
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
