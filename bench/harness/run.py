"""Run suites: measure the blocks that are not yet on record, and store each as it is done."""

import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import distinct_texts

from .block import SCALES, Block
from .choice import Choice
from .executor import THIS_PROCESS, Executor, NotMeasured
from .experiment import blocks
from .folder_lock import locked
from .machine import conditions
from .measure import block_key, now
from .measure import measure as measure  # by which a rerun measures any revision
from .record import FINISHED, Key, Record, RecordFile

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
    suites: Sequence[str], scale: str | Choice, folder: Path, executor: Executor = THIS_PROCESS
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
            file.arrange(map(block_key, wanted))
            spent = time.perf_counter() - begin
            for suite in together:
                asked = {block_key(block) for block in wanted if block.suite == suite}
                if not choice.is_partial:
                    _finish(_finished(suite, choice.name, len(asked), spent, executor), asked, file)
                yield from _not_asked_for(suite, asked, file, choice.is_partial)


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
            yield _event(KEPT, block)
    missing = [block for block in wanted if again[block_key(block)] is not None]
    for step in executor.measure(missing, choice.scale):
        match step:
            case Block():
                yield _event(MEASURING, step, again[block_key(step)] or "")
            case NotMeasured(block, why):
                yield _event(FAILED, block, why)
            case Record():
                file.append([step])
                yield _event(FAILED if step.failed else MEASURED, step, step.failed)


def _event(state: str, of: Block | Record, message: str = "") -> Event:
    return Event(state, of.suite, f"{of.problem}, {of.solver}", message)


def _finished(suite: str, scale: str, count: int, seconds: float, executor: Executor) -> Record:
    """Return the record that says that a suite was gone through to its end."""
    return Record(
        FINISHED, suite, "", size=count, notes={"scale": scale}, stamp=executor.stamp(),
        when=now(), seconds=seconds, conditions=conditions(),
    )  # fmt: skip


def _finish(finished: Record, asked: Set[Key], file: RecordFile) -> None:
    """Put on record that a suite was gone through, if it is new and all is on record."""
    records = {record.key: record for record in file.read().records}
    before = records.get(finished.key)
    is_said = before is not None and all(
        getattr(before, name) == getattr(finished, name) for name in ("size", "notes", "stamp")
    )
    if asked <= records.keys() and not is_said:
        file.append([finished])


def _not_asked_for(
    suite: str, asked: Set[Key], file: RecordFile, is_partial: bool
) -> Iterator[Event]:
    """Say how many records of a suite were not asked for; mark those under settings of before."""
    extra = [r for r in file.read().records if r.suite == suite and r.key not in asked]
    if is_partial:
        if extra:
            yield Event(NOT_RUN, suite, "", f"{_records(len(extra))} of what was not chosen kept")
        return
    old = [record for record in extra if _is_superseded(record, asked)]
    if newly := [record for record in old if not record.superseded]:
        file.append([replace(r, notes={**r.notes, "superseded": now()}) for r in newly])
    for solver, count in Counter(record.solver for record in old).items():
        why = f"{_records(count)} of {solver} under other settings kept, left out of tables"
        yield Event(NOT_RUN, suite, solver, why)
    for solver, count in Counter(record.solver for record in extra if record not in old).items():
        yield Event(NOT_RUN, suite, solver, f"{_records(count)} of {solver} kept, not run")


def _records(count: int) -> str:
    return f"{count} record{'' if count == 1 else 's'}"


def _is_superseded(record: Record, asked: Set[Key]) -> bool:
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
    choice = chosen(scale)
    return set(map(block_key, filter(choice.takes, blocks(suite, choice.scale))))


def chosen(scale: str | Choice) -> Choice:
    """Return everything at a scale by its name; a choice is returned as it is."""
    return scale if isinstance(scale, Choice) else Choice(scale, SCALES[scale])


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
