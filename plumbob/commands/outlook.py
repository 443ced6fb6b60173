"""What a run would measure, and how long that may take."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from plumbob.bench.entrants.blocks import CHAIN_BUDGET
from plumbob.bench.experiments import blocks, chain, cloth_peers, published
from plumbob.bench.experiments.cloth_peers import measurement as cloths
from plumbob.bench.experiments.robots import REACHABLE, UNREACHABLE
from plumbob.bench.harness import run
from plumbob.bench.harness.block import Block, Scale
from plumbob.bench.harness.choice import Choice
from plumbob.bench.harness.executor import HERE
from plumbob.bench.harness.measure import block_key
from plumbob.bench.harness.record import Key, Record, RecordFile

RECORDED, ALIKE, BUDGET, UNKNOWN = "its own record", "records of others", "budgets", "unknown"
# Budgets of a block in seconds, for those of a benchmark at its scale, by its task; an entrant's on
# skeletons.
_BUDGETS = {REACHABLE: 3.0, UNREACHABLE: 3.0, published.TRAC_IK: 15.0, published.TOOLBOX: 15.0}
_ENTERED = {chain.CHAIN: CHAIN_BUDGET, published.FABRIK: CHAIN_BUDGET}
# Parts of a cloth's ladder that use its whole budget.
_LADDER = 2.0


class Planned(NamedTuple):
    """A block to be measured, why again, how long [s] it may take, and how that is known."""

    block: Block
    why: str
    seconds: float
    source: str


def planned(suites: Sequence[str], choice: Choice, folder: Path) -> Iterator[Planned | Block]:
    """Yield what would be measured, and as it is what is on record."""
    records = RecordFile(folder).read().records
    present = {record.key: record for record in records}
    for suite in suites:
        for block in filter(choice.takes, blocks(suite, choice.scale)):
            why = run.why_again(block, present, HERE)
            if why is None:
                yield block
            else:
                yield Planned(block, why, *_estimate(block, present, choice.scale))


def _estimate(block: Block, present: Mapping[Key, Record], scale: Scale) -> tuple[float, str]:
    own = present.get(block_key(block))
    if own is not None and own.seconds > 0.0 and not own.failed:
        return _for_size(own, block), RECORDED
    alike = [
        _for_size(record, block)
        for record in present.values()
        if record.suite == block.suite and record.problem == block.problem and record.seconds > 0.0
    ]
    if alike:
        return median(alike), ALIKE
    budget = _budget(block, scale)
    return budget, BUDGET if budget else UNKNOWN


def _for_size(record: Record, block: Block) -> float:
    """Return the seconds of a record, for a block of another size."""
    return record.seconds * (block.size / record.size if block.size and record.size else 1.0)


def _budget(block: Block, scale: Scale) -> float:
    task = block.facts.get("task")
    if task in (cloth_peers.ONE_STEP, cloth_peers.MOTION):
        return _LADDER * sum(level.budget for level in cloths.levels(scale))
    if block.suite == "timing":
        return scale.seconds
    known = _BUDGETS | (_ENTERED if block.facts.get("entrant") else {})
    return known.get(str(task), 0.0) * scale.seconds


def dry_run(suites: Sequence[str], choice: Choice, folder: Path) -> list[str]:
    """Return lines that say what a run would do."""
    found = list(planned(suites, choice, folder))
    measured = [one for one in found if isinstance(one, Planned)]
    lines = [f"{len(measured)} to measure, {len(found) - len(measured)} kept as on record"]
    for suite in suites:
        mine = [one for one in measured if one.block.suite == suite]
        solvers = Counter(one.block.solver for one in mine)
        for solver, count in solvers.items():
            theirs = [one for one in mine if one.block.solver == solver]
            again = Counter(one.why for one in theirs if one.why)
            reasons = "".join(f"; again {n}, for {why}" for why, n in again.items())
            time = duration(sum(one.seconds for one in theirs))
            lines.append(f"  {suite}: {solver}: {count}, about {time}{reasons}")
    return [*lines, _total(measured)]


def _total(measured: Sequence[Planned]) -> str:
    if not measured:
        return "nothing would be measured"
    sources = Counter(one.source for one in measured)
    unknown = sources.pop(UNKNOWN, 0)
    known = ", ".join(f"{count} from {source}" for source, count in sources.items())
    rest = f"; of {unknown} nothing is known" if unknown else ""
    total = duration(sum(one.seconds for one in measured))
    return f"about {total} in all ({known or 'no estimate'}{rest}), without compilation"


def duration(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 90.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
