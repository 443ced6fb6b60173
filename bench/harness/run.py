"""Run suites: measure the blocks that are not yet on record, and store each as it is done."""

import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..experiments import SCALES, Block, blocks
from .machine import stamp
from .record import FINISHED, Key, Record, RecordFile, key

KEPT, MEASURING, MEASURED, FAILED = "kept", "measuring", "measured", "failed"


class Event(NamedTuple):
    """A step of a run.

    Attributes:
        state: "kept" if a record of it was there, "measuring", "measured" or "failed".
        suite: the suite.
        what: problem and solver.
        message: why it failed, else "".
    """

    state: str
    suite: str
    what: str
    message: str = ""


def run(suites: Sequence[str], scale: str, folder: Path) -> Iterator[Event]:
    """Measure suites in order, yielding what happens; records already there are kept.

    A block is measured again where its record is from other sources, versions or another machine,
    smaller than asked for, or failed.

    Raises:
        ValueError: if the result file cannot be read.
    """
    file = RecordFile(folder)
    present = {record.key: record for record in file.read().records}
    for suite in suites:
        begin = time.perf_counter()
        yield from _run_suite(suite, scale, file, present)
        wanted = keys(suite, scale)
        if wanted <= {record.key for record in file.read().records}:
            file.append([_finished(suite, scale, len(wanted), time.perf_counter() - begin)])
        file.drop(partial(_is_left_over, suite, wanted))


def _run_suite(
    suite: str, scale: str, file: RecordFile, present: dict[Key, Record]
) -> Iterator[Event]:
    for block in blocks(suite, SCALES[scale]):
        yield from _run_block(block, file, present)


def _finished(suite: str, scale: str, count: int, seconds: float) -> Record:
    """Return the record that says that a suite was gone through to its end."""
    made: dict[str, Any] = {"stamp": stamp(), "when": now(), "seconds": seconds}
    return Record(FINISHED, suite, "", size=count, notes={"scale": scale}, **made)


def _is_left_over(suite: str, known: set[Key], record: Record) -> bool:
    """Return whether a record belongs to the suite as it was once, but no longer is."""
    return record.suite == suite and record.key not in known


def missed_claims(suites: Sequence[str], folder: Path) -> list[str]:
    """Return a sentence for each claim on record, of the suites given, that does not hold."""
    if "check" not in suites:
        return []
    checks = [r for r in RecordFile(folder).read().records if r.suite == "check"]
    missed = [record for record in checks if not np.all(record.arrays.get("held", True))]
    return [f"claim {r.problem!r} missed: {r.notes.get('missed', '')}" for r in missed]


def forget(suites: Sequence[str], folder: Path) -> None:
    """Remove the records of some suites.

    Raises:
        ValueError: if the result file cannot be read.
    """
    RecordFile(folder).drop(
        lambda record: (record.problem if record.suite == FINISHED else record.suite) in suites
    )


def count(suites: Sequence[str], scale: str) -> int:
    """Return how many blocks there are, measured or not."""
    return sum(len(keys(suite, scale)) for suite in suites)


def keys(suite: str, scale: str) -> set[Key]:
    """Return the keys of all records of a suite that was gone through."""
    return {block_key(block) for block in blocks(suite, SCALES[scale])}


def block_key(block: Block) -> Key:
    """Return the key of a block's record."""
    return key(block.suite, block.problem, block.solver, block.settings)


def is_done(record: Record | None, size: float) -> bool:
    """Return whether a record of the wanted size was made by these sources on this machine."""
    return (
        record is not None
        and not record.failed
        and record.size >= size
        and dict(record.stamp) == stamp()
    )


def now() -> str:
    """Return the moment, ISO 8601, in UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def _run_block(block: Block, file: RecordFile, present: dict[Key, Record]) -> Iterator[Event]:
    what = f"{block.problem}, {block.solver}"
    if is_done(present.get(block_key(block)), block.size):
        yield Event(KEPT, block.suite, what)
        return
    yield Event(MEASURING, block.suite, what)
    record = measure(block)
    file.append([record])
    yield Event(FAILED if record.failed else MEASURED, block.suite, what, record.failed)


def measure(block: Block) -> Record:
    """Measure a block; one that raises becomes a record that says why, and costs no other."""
    begin = time.perf_counter()
    try:
        arrays, notes, facts = block.measure()
    except Exception as error:  # whatever a solver raises is a result of that solver
        if isinstance(error.__cause__, KeyboardInterrupt):  # Ctrl-C inside compiled code
            raise KeyboardInterrupt from None
        arrays, notes, facts = {}, {"failed": f"{type(error).__name__}: {error}"}, {}
    return Record(
        block.suite,
        block.problem,
        block.solver,
        block.settings,
        block.size,
        {name: np.asarray(values) for name, values in arrays.items()},
        notes,
        stamp(),
        now(),
        time.perf_counter() - begin,
        {**block.facts, **facts},
    )
