"""What a run would measure, and how long that may take."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from plumbob.bench.experiments import blocks
from plumbob.bench.harness import run
from plumbob.bench.harness.block import Block, Choice
from plumbob.bench.harness.executors import THIS_PROCESS
from plumbob.bench.harness.measure import block_key
from plumbob.bench.harness.record import Key, Record, RecordFile

RECORDED, ALIKE, BUDGET, UNKNOWN = "its own record", "records of others", "budgets", "unknown"


class Planned(NamedTuple):
    """A block to be measured, why again, how long [s] it may take, and how that is known."""

    block: Block
    why: str
    seconds: float
    source: str


def planned(suites: Sequence[str], choice: Choice, folder: Path) -> Iterator[Planned | Block]:
    """Yield what would be measured, and as it is what is on record."""
    present = {record.key: record for record in RecordFile(folder).read().records}
    for suite in suites:
        for block in filter(choice.takes, blocks(suite, choice.scale)):
            why = run.why_again(block, present, THIS_PROCESS)
            yield block if why is None else Planned(block, why, *_estimate(block, present))


def _estimate(block: Block, present: Mapping[Key, Record]) -> tuple[float, str]:
    own = present.get(block_key(block))
    if own is not None and own.seconds > 0.0 and not own.failed:
        return _for_size(own, block), RECORDED
    alike = [
        _for_size(record, block)
        for record in present.values()
        if (record.suite, record.problem) == (block.suite, block.problem) and record.seconds > 0.0
    ]
    if alike:
        return median(alike), ALIKE
    return block.budget, BUDGET if block.budget else UNKNOWN


def _for_size(record: Record, block: Block) -> float:
    """Return the seconds of a record, for a block of another size."""
    return record.seconds * (block.size / record.size if block.size and record.size else 1.0)


def dry_run(suites: Sequence[str], choice: Choice, folder: Path) -> list[str]:
    """Return lines that say what a run would do."""
    plan = list(planned(suites, choice, folder))
    measured = [step for step in plan if isinstance(step, Planned)]
    lines = [f"{len(measured)} to measure, {len(plan) - len(measured)} kept as on record"]
    by_solver: dict[tuple[str, str], list[Planned]] = {}
    for step in measured:
        by_solver.setdefault((step.block.suite, step.block.solver), []).append(step)
    for (suite, solver), steps in by_solver.items():
        again = Counter(step.why for step in steps if step.why)
        reasons = "".join(f"; again {count}, for {why}" for why, count in again.items())
        time = duration(sum(step.seconds for step in steps))
        lines.append(f"  {suite}: {solver}: {len(steps)}, about {time}{reasons}")
    return [*lines, _total(measured)]


def _total(measured: Sequence[Planned]) -> str:
    if not measured:
        return "nothing would be measured"
    sources = Counter(step.source for step in measured)
    unknown = sources.pop(UNKNOWN, 0)
    known = ", ".join(f"{count} from {source}" for source, count in sources.items())
    rest = f"; of {unknown} nothing is known" if unknown else ""
    total = duration(sum(step.seconds for step in measured))
    return f"about {total} in all ({known or 'no estimate'}{rest}), without compilation"


def duration(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 90.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
