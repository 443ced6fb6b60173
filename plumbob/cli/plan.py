"""List problems and solvers of the bench, and the work and time of a run."""

import re
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from plumbob.bench.experiments import SUITES, blocks
from plumbob.bench.measure import run
from plumbob.bench.measure.block import Block, Choice
from plumbob.bench.measure.executors import THIS_PROCESS
from plumbob.bench.measure.measure import block_key, not_asked, not_installed
from plumbob.bench.measure.record import Key, Record, RecordFile
from plumbob.bench.peers import catalogue, packages
from plumbob.bench.tables.results import counted, grouped

from .terminal import width

NOT_INSTALLED = "not installed"
# Names of problems or solvers in the list of all suites, and their lines.
_MAX_NAMES, _MAX_LINES = 6, 2
_PACKAGES = {catalogue.PLUMBOB: "plumbob", catalogue.PINOCCHIO: "pin", catalogue.MUJOCO: "mujoco"}


def listed(suites: Sequence[str], choice: Choice) -> Iterator[str]:
    """Yield lines with all problems and solvers of a suite, or a summary of several suites."""
    for suite in suites:
        selection = list(filter(choice.takes, blocks(suite, choice.scale)))
        problems, solvers = _problems(selection), _solvers(selection)
        yield f"{suite}: {SUITES[suite]}"
        if len(suites) == 1:
            yield from ("", "problems", *_aligned(problems.items()))
            for problem_names, rows in grouped(solvers, partial(_problems_of, selection)).items():
                yield from ("", f"solvers of {problem_names}", *_aligned(rows))
        else:
            yield from _in_short("problem", problems)
            yield from _in_short("solver", [name for name, *_ in solvers])
    if len(suites) > 1:
        yield "All problems and solvers of a suite: plumbob bench SUITE --list"


def _problems(selection: Iterable[Block]) -> dict[str, str]:
    """Return the titles of problems by their names, "" for a title equal to the name."""
    return {
        block.problem: _unless_repeated(block.problem, str(block.facts.get("title", "")))
        for block in selection
        if not _measures(block, not_installed, not_asked)
    }


def _problems_of(selection: Iterable[Block], solver: tuple[str, ...]) -> str:
    """Return the problems of a solver, counted by families: "chain (4); published (2)"."""
    own = [block for block in selection if block.solver == solver[0]]
    problems = dict.fromkeys(block.problem for block in own if not _measures(block, not_asked))
    families = Counter(problem.partition("/")[0] for problem in problems)
    if len(families) > _MAX_NAMES:
        return counted(len(problems), "problem")
    whole = {problem.removesuffix("/all") for problem in problems}
    return "; ".join(f if f in whole else f"{f} ({count})" for f, count in families.items())


def _solvers(selection: Iterable[Block]) -> list[tuple[str, str, str]]:
    """Return name, different label and version of each solver, missing solvers last."""
    by_solver = {block.solver: block for block in selection}
    missing = {name for name, block in by_solver.items() if _measures(block, not_installed)}
    names = [*(name for name in by_solver if name not in missing), *sorted(missing)]
    return [
        (
            name,
            _unless_repeated(name, catalogue.find(name).label),
            NOT_INSTALLED if name in missing else _version(by_solver[name]),
        )
        for name in names
    ]


def _unless_repeated(name: str, title: str) -> str:
    """Return a title, "" if the name ends with the same words."""
    plain_name, plain_title = (
        re.sub(r"[\W_]+", " ", text).casefold().strip() for text in (name, title)
    )
    return "" if plain_name.endswith(plain_title) else title


def _measures(block: Block, *functions: Callable[..., Any]) -> bool:
    """Return whether a block is measured by a given function."""
    return isinstance(block.measure, partial) and block.measure.func in functions


def _version(block: Block) -> str:
    """Return the version of a block's solver: its own, or its engine's."""
    version = block.settings.get("version")
    if block.facts.get("entrant") is True:
        return ", ".join(str(part) for part in (version, "entered", block.facts["door"]) if part)
    package = _PACKAGES.get(catalogue.find(block.solver).engine, "")
    return str(version or (packages.version(package) if package else ""))


def _aligned(rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield rows as lines with aligned columns."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip_longest(*rows, fillvalue="")]
    for row in rows:
        padded = (f"{cell:<{wide}}" for cell, wide in zip(row, widths, strict=True) if wide)
        yield "  " + "  ".join(padded).rstrip()


def _in_short(noun: str, names: Iterable[str]) -> Iterator[str]:
    """Yield the number of names, and the first names or families."""
    names = list(names)
    families = list(dict.fromkeys(name.partition("/")[0] for name in names))
    for count in range(_MAX_NAMES, 0, -1):
        more = f" and {len(families) - count} more" if len(families) > count else ""
        text = f"  {counted(len(names), noun)}: {'; '.join(families[:count])}{more}"
        lines = textwrap.wrap(text, width(), subsequent_indent="    ")
        if len(lines) <= _MAX_LINES:
            break
    yield from lines


class PlannedBlock(NamedTuple):
    """A block to be measured, the reason if again, and its time [s], 0 if unknown."""

    block: Block
    reason: str
    seconds: float


def dry_run(suites: Sequence[str], choice: Choice, folder: Path) -> list[str]:
    """Return lines on the work and time of a run."""
    present = {record.key: record for record in RecordFile(folder).read().records}
    every = [b for suite in suites for b in filter(choice.takes, blocks(suite, choice.scale))]
    selection = [block for block in every if not _measures(block, not_installed, not_asked)]
    reasons = [run.why_again(block, present, THIS_PROCESS) for block in selection]
    steps = [
        PlannedBlock(block, reason, _estimate(block, present))
        for block, reason in zip(selection, reasons, strict=True)
        if reason is not None
    ]
    lines = [f"{len(steps):,} to measure, {len(selection) - len(steps):,} already on record"]
    by_solver = grouped(steps, lambda step: (step.block.suite, step.block.solver))
    for (suite, solver), group in by_solver.items():
        repeats = Counter(step.reason for step in group if step.reason)
        whys = "".join(f"; again {count:,}, for {reason}" for reason, count in repeats.items())
        lines.append(f"  {suite}: {solver}: {len(group):,}, {_time(group)}{whys}")
    total = f"Total: {_time(steps)}, without compilation"
    return [*lines, total if steps else "Nothing would be measured"]


def _estimate(block: Block, present: Mapping[Key, Record]) -> float:
    """Return the expected seconds by a block's record, by other solvers, or by its budget."""
    own = present.get(block_key(block))
    if own is not None and own.seconds > 0.0 and not own.failed:
        return _scaled_time(own, block)
    times = [
        _scaled_time(record, block)
        for record in present.values()
        if (record.suite, record.problem) == (block.suite, block.problem) and record.seconds > 0.0
    ]
    return median(times) if times else block.budget


def _scaled_time(record: Record, block: Block) -> float:
    """Return the seconds of a record, in proportion to the size of a block."""
    return record.seconds * (block.size / record.size if block.size and record.size else 1.0)


def _time(steps: Sequence[PlannedBlock]) -> str:
    """Return the expected time as words: "about 12 s", "time unknown"."""
    times = [step.seconds for step in steps if step.seconds]
    if not times:
        return "time unknown"
    unknown = len(steps) - len(times)
    return f"about {duration(sum(times))}{f' and the unknown time of {unknown}' * bool(unknown)}"


def duration(seconds: float) -> str:
    """Return a time in seconds, minutes or hours: "12 s"."""
    if seconds < 90.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
