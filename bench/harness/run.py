"""Run suites: measure the blocks that are not yet on record, and store each as it is done."""

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..experiments import SCALES, Block, blocks
from .folder_lock import locked
from .machine import conditions, difference, stamp
from .record import FINISHED, Key, Record, RecordFile, key

KEPT, MEASURING, MEASURED, FAILED = "kept", "measuring", "measured", "failed"
NOT_RUN = "not run"


class Event(NamedTuple):
    """A step of a run.

    Attributes:
        state: "kept" if a record of it was there, "measuring", "measured", "failed", or "not run"
            for records of a solver that nothing asks for.
        suite: the suite.
        what: problem and solver.
        message: why it is measured again, why it failed, or how many were not run; else "".
    """

    state: str
    suite: str
    what: str
    message: str = ""


def run(suites: Sequence[str], scale: str, folder: Path) -> Iterator[Event]:
    """Measure suites in order, yielding what happens; records already there are kept.

    A block is measured again where its record is from other sources, versions or another machine,
    smaller than asked for, or failed. Records that nothing asks for are kept.

    Raises:
        ValueError: if the result file cannot be read, or another run writes to it.
    """
    file = RecordFile(folder)
    with locked(folder):
        present = {record.key: record for record in file.read().records}
        for suite in suites:
            begin = time.perf_counter()
            yield from _run_suite(suite, scale, file, present)
            yield from _finish(suite, scale, file, begin)


def _run_suite(
    suite: str, scale: str, file: RecordFile, present: dict[Key, Record]
) -> Iterator[Event]:
    for block in blocks(suite, SCALES[scale]):
        yield from _run_block(block, file, present)


def _finish(suite: str, scale: str, file: RecordFile, begin: float) -> Iterator[Event]:
    """Put on record that a suite was gone through, and say what it did not ask for."""
    asked = keys(suite, scale)
    records = {record.key: record for record in file.read().records}
    finished = _finished(suite, scale, len(asked), time.perf_counter() - begin)
    if asked <= records.keys() and not _says_the_same(records.get(finished.key), finished):
        file.append([finished])
    extra = [r for r in records.values() if r.suite == suite and r.key not in asked]
    old = [record for record in extra if _is_superseded(record, asked)]
    if newly := [record for record in old if not record.superseded]:
        file.append([replace(r, notes={**r.notes, "superseded": now()}) for r in newly])
    for solver, count in Counter(record.solver for record in old).items():
        why = f"{_records(count)} of {solver} under other settings kept, left out of tables"
        yield Event(NOT_RUN, suite, solver, why)
    for solver, count in Counter(r.solver for r in extra if r not in old).items():
        yield Event(NOT_RUN, suite, solver, f"{_records(count)} of {solver} kept, not run")


def _records(count: int) -> str:
    return f"{count} record{'' if count == 1 else 's'}"


def _finished(suite: str, scale: str, count: int, seconds: float) -> Record:
    """Return the record that says that a suite was gone through to its end."""
    made: dict[str, Any] = {"stamp": stamp(), "when": now(), "seconds": seconds}
    made["conditions"] = conditions()
    return Record(FINISHED, suite, "", size=count, notes={"scale": scale}, **made)


def _says_the_same(record: Record | None, other: Record) -> bool:
    return record is not None and (record.size, record.notes, record.stamp) == (
        other.size, other.notes, other.stamp,
    )  # fmt: skip


def _is_superseded(record: Record, asked: set[Key]) -> bool:
    """Return whether a record that is not asked for belongs to what is, or to nothing measured.

    Its problem and solver are asked for under other settings, or it says only that something was
    missing.
    """
    if not record.arrays and not record.failed:
        return True
    return record.key[:3] in {key[:3] for key in asked}


def missed_claims(suites: Sequence[str], folder: Path) -> list[str]:
    """Return a sentence for each claim on record, of the suites given, that does not hold."""
    if "check" not in suites:
        return []
    checks = [r for r in RecordFile(folder).read().records if r.suite == "check"]
    missed = [record for record in checks if not np.all(record.arrays.get("held", True))]
    return [f"claim {r.problem!r} missed: {r.notes.get('missed', '')}" for r in missed]


def forget(suites: Sequence[str], scale: str, folder: Path) -> None:
    """Remove the records of what is to be measured; those that nothing asks for stay.

    Raises:
        ValueError: if the result file cannot be read, or a run writes to it.
    """
    asked = {key for suite in suites for key in keys(suite, scale)}
    with locked(folder):
        RecordFile(folder).drop(
            lambda record: (
                record.key in asked or (record.suite == FINISHED and record.problem in suites)
            )
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


def why_again(record: Record, size: float) -> str:
    """Return why a block of this size is measured again beside its record, "" if it is not."""
    if record.failed:
        return "it failed before"
    if record.superseded:
        return "its settings are asked for again"
    if record.size < size:
        return f"a larger size ({record.size:g}, now {size:g})"
    return difference(record.stamp, stamp())


def now() -> str:
    """Return the moment, ISO 8601, in UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def _run_block(block: Block, file: RecordFile, present: dict[Key, Record]) -> Iterator[Event]:
    what = f"{block.problem}, {block.solver}"
    there = present.get(block_key(block))
    again = why_again(there, block.size) if there else ""
    if there and not again:
        yield Event(KEPT, block.suite, what)
        return
    yield Event(MEASURING, block.suite, what, again)
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
        conditions(),
    )
