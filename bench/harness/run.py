"""Run suites: measure the blocks that are not yet on record, and store each as it is done."""

import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import distinct_texts

from ..experiments import SCALES, Block, blocks
from .choice import Choice
from .executor import HERE, Executor, NotMeasured
from .folder_lock import locked
from .machine import conditions
from .measure import block_key, measure, now
from .record import FINISHED, Key, Record, RecordFile

__all__ = [
    "Event",
    "block_key",
    "count",
    "forget",
    "keys",
    "measure",
    "missed_claims",
    "now",
    "run",
]

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


def run(
    suites: Sequence[str], scale: str | Choice, folder: Path, executor: Executor = HERE
) -> Iterator[Event]:
    """Measure suites, yielding what happens; records already there are kept.

    A block is measured again where its record is from other sources, versions or another machine,
    smaller than asked for, or failed. Records that nothing asks for are kept. In this process
    suites are measured in order. The scale is a name, or a choice of what there is at one.

    Raises:
        ValueError: if the result file cannot be read, or another run writes to it; or if the
            executor cannot go on.
    """
    file, choice = RecordFile(folder), chosen(scale)
    with locked(folder):
        present = {record.key: record for record in file.read().records}
        for together in [suites] if executor.takes_suites_together else [[s] for s in suites]:
            begin = time.perf_counter()
            every = [block for suite in together for block in blocks(suite, choice.scale)]
            executor.look_at(present.get(block_key(block)) for block in every if block.times)
            wanted = [block for block in every if choice.takes(block)]
            yield from _run_blocks(wanted, choice, file, present, executor)
            file.arrange(block_key(block) for block in wanted)
            for suite in together:
                spent = time.perf_counter() - begin
                asked = [block for block in wanted if block.suite == suite]
                if choice.is_partial:
                    yield from _leave(suite, asked, file)
                    continue
                end = _finished(suite, choice.name, spent, executor.stamp())
                yield from _finish(end, asked, file)


def _run_blocks(
    wanted: Sequence[Block],
    choice: Choice,
    file: RecordFile,
    present: Mapping[Key, Record],
    executor: Executor,
) -> Iterator[Event]:
    """Have the blocks measured that are not on record; write each record as it comes."""
    again = {block_key(block): why_again(block, present, executor) for block in wanted}
    for block in wanted:
        if again[block_key(block)] is None:
            yield Event(KEPT, block.suite, _what(block))
    missing = [block for block in wanted if again[block_key(block)] is not None]
    for step in executor.measure(missing, choice.scale):
        match step:
            case Block():
                yield Event(MEASURING, step.suite, _what(step), again[block_key(step)] or "")
            case NotMeasured(block, why):
                yield Event(FAILED, block.suite, _what(block), why)
            case Record():
                file.append([step])
                state = FAILED if step.failed else MEASURED
                yield Event(state, step.suite, _what(step), step.failed)


def _what(named: Block | Record) -> str:
    return f"{named.problem}, {named.solver}"


def _leave(suite: str, blocks: Sequence[Block], file: RecordFile) -> Iterator[Event]:
    """Say how many records of a suite a choice did not ask for."""
    asked = set(map(block_key, blocks))
    others = [r for r in file.read().records if r.suite == suite and r.key not in asked]
    if others:
        yield Event(NOT_RUN, suite, "", f"{_records(len(others))} of what was not chosen kept")


def _finish(finished: Record, blocks: Sequence[Block], file: RecordFile) -> Iterator[Event]:
    """Put on record that a suite was gone through, and say what it did not ask for."""
    asked = set(map(block_key, blocks))
    suite, finished = finished.problem, replace(finished, size=len(asked))
    records = {record.key: record for record in file.read().records}
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


def _finished(suite: str, scale: str, seconds: float, where: Mapping[str, Any]) -> Record:
    """Return the record that says that a suite was gone through to its end."""
    made: dict[str, Any] = {"stamp": where, "when": now(), "seconds": seconds}
    made["conditions"] = conditions()
    return Record(FINISHED, suite, "", notes={"scale": scale}, **made)


def _says_the_same(record: Record | None, other: Record) -> bool:
    return record is not None and (record.size, record.notes, record.stamp) == (
        other.size, other.notes, other.stamp,
    )  # fmt: skip


def _is_superseded(record: Record, asked: set[Key]) -> bool:
    """Return whether a record that is not asked for belongs to what is, or to nothing measured.

    Its problem and solver are asked for under other settings, or it says only that something was
    missing.
    """
    if not record.arrays and not record.failed and not record.facts.get("entrant"):
        return True
    return record.key[:3] in {key[:3] for key in asked}


def missed_claims(suites: Sequence[str], folder: Path) -> list[str]:
    """Return a sentence for each claim on record, of the suites given, that does not hold."""
    if "check" not in suites:
        return []
    checks = [r for r in RecordFile(folder).read().records if r.suite == "check"]
    missed = [record for record in checks if not np.all(record.arrays.get("held", True))]
    return [f"claim {r.problem!r} missed: {r.notes.get('missed', '')}" for r in missed]


def forget(suites: Sequence[str], scale: str | Choice, folder: Path) -> None:
    """Remove the records of what is to be measured; those that nothing asks for stay.

    Raises:
        ValueError: if the result file cannot be read, or a run writes to it.
    """
    asked = {key for suite in suites for key in keys(suite, scale)}
    begun = () if chosen(scale).is_partial else suites
    with locked(folder):
        RecordFile(folder).drop(
            lambda record: (
                record.key in asked or (record.suite == FINISHED and record.problem in begun)
            )
        )


def count(suites: Sequence[str], scale: str | Choice) -> int:
    """Return how many blocks there are, measured or not."""
    return sum(len(keys(suite, scale)) for suite in suites)


def keys(suite: str, scale: str | Choice) -> set[Key]:
    """Return the keys of all records of a suite that was gone through."""
    return {block_key(block) for block in _asked_for(suite, chosen(scale))}


def chosen(scale: str | Choice) -> Choice:
    """Return everything at a scale by its name; a choice is returned as it is."""
    return scale if isinstance(scale, Choice) else Choice(scale, SCALES[scale])


def _asked_for(suite: str, choice: Choice) -> Iterator[Block]:
    return (block for block in blocks(suite, choice.scale) if choice.takes(block))


def why_again(block: Block, present: Mapping[Key, Record], executor: Executor) -> str | None:
    """Return why a block is measured though there is a record, "" if there is none, or None."""
    record = present.get(block_key(block))
    if record is None:
        return ""
    if record.failed:
        return "it failed before"
    if record.superseded:
        return "its settings are asked for again"
    if record.size < block.size:
        return "a larger size ({}, now {})".format(*distinct_texts(record.size, block.size))
    if record.facts.get("problem_digest") != block.facts.get("problem_digest"):
        return f"{block.problem} is another problem now"
    before, digest = record.facts.get("digest", ""), block.facts.get("digest", "")
    if before != digest:
        return f"other sources of {block.solver} ({before or 'none'}, now {digest or 'none'})"
    return executor.difference(block, record) or None
