"""Run suites: measure the blocks not yet on record, and store each when done."""

import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import distinct_texts

from .block import SCALES, Block, Choice
from .executors import THIS_PROCESS, Executor, NotMeasured
from .experiment import blocks
from .folder_lock import locked
from .machine import conditions
from .measure import block_key, now
from .measure import measure as measure  # by which a rerun measures any revision
from .record import FINISHED, Key, Record, RecordFile

KEPT, MEASURING, MEASURED, FAILED = "kept", "measuring", "measured", "failed"
NOT_RUN = "not run"


class Event(NamedTuple):
    """A step of a run."""

    # "kept" if on record before, "measuring", "measured", "failed", or "not run" for records of a
    # solver outside this run
    state: str
    suite: str  # the suite
    subject: str  # problem and solver
    message: str = ""  # why it is measured again, why it failed, or how many were not run; else ""


def run(
    suites: Sequence[str], scale: str | Choice, folder: Path, executor: Executor = THIS_PROCESS
) -> Iterator[Event]:
    """Measure suites, yielding events; valid records are kept.

    A block is measured again where its record is from other sources, versions or another machine,
    is smaller than requested, or failed. Records of other blocks are kept. Suites are measured in
    order. The scale is a name, or a choice of blocks.

    Raises:
        ValueError: if the result file cannot be read, or another run writes to it; or if the
            executor cannot go on.
    """
    file, choice = RecordFile(folder), choice_at(scale)
    with locked(folder):
        present = {record.key: record for record in file.read().records}
        for suite in suites:
            begin = time.perf_counter()
            selected = [block for block in blocks(suite, choice.scale) if choice.takes(block)]
            yield from _run_blocks(selected, choice, file, present, executor)
            suite_keys = {block_key(block) for block in selected}
            file.arrange(map(block_key, selected))
            seconds = time.perf_counter() - begin
            if not choice.is_partial:
                _record_finish(suite, suite_keys, choice.name, seconds, executor, file)
            yield from _extra_records(suite, suite_keys, file, choice.is_partial)


def _run_blocks(
    selected: Sequence[Block],
    choice: Choice,
    file: RecordFile,
    present: Mapping[Key, Record],
    executor: Executor,
) -> Iterator[Event]:
    """Measure the blocks not on record; write each record on arrival."""
    reasons = {block_key(block): why_again(block, present, executor) for block in selected}
    missing = []
    for block in selected:
        if reasons[block_key(block)] is None:
            yield _event(KEPT, block)
        else:
            missing.append(block)
    for step in executor.measure(missing, choice.scale):
        match step:
            case Block():
                yield _event(MEASURING, step, reasons[block_key(step)] or "")
            case NotMeasured(block, reason):
                yield _event(FAILED, block, reason)
            case Record():
                file.append([step])
                yield _event(FAILED if step.failed else MEASURED, step, step.failed)


def _event(state: str, of: Block | Record, message: str = "") -> Event:
    return Event(state, of.suite, f"{of.problem}, {of.solver}", message)


def _record_finish(
    suite: str,
    suite_keys: Set[Key],
    scale: str,
    seconds: float,
    executor: Executor,
    file: RecordFile,
) -> None:
    """Record the end of a suite, if all of its blocks are on record."""
    finished = Record(
        FINISHED, suite, "", measured={"scale": scale}, size=len(suite_keys),
        stamp=executor.stamp(), when=now(), seconds=seconds, conditions=conditions(),
    )  # fmt: skip
    records = {record.key: record for record in file.read().records}
    previous = records.get(finished.key)
    is_recorded = previous is not None and all(
        getattr(previous, name) == getattr(finished, name) for name in ("size", "measured", "stamp")
    )
    if suite_keys <= records.keys() and not is_recorded:
        file.append([finished])


def _extra_records(
    suite: str, suite_keys: Set[Key], file: RecordFile, is_partial: bool
) -> Iterator[Event]:
    """Report the unrequested records of a suite; mark records with old settings."""
    records = [record for record in file.read().records if record.suite == suite]
    extra = [record for record in records if record.key not in suite_keys]
    if is_partial:
        if extra:
            yield Event(NOT_RUN, suite, "", f"{_records(len(extra))} of what was not chosen kept")
        return
    current = {key[:3] for key in suite_keys}
    old = []
    for record in extra:
        is_remark = not (record.has_numbers or record.failed or record.measured.get("entrant"))
        if is_remark or record.key[:3] in current:
            old.append(record)
    if newly := [record for record in old if not record.superseded]:
        file.append([record.with_measured(superseded=now()) for record in newly])
    for solver, count in Counter(record.solver for record in old).items():
        why = f"{_records(count)} of {solver} under other settings kept, left out of tables"
        yield Event(NOT_RUN, suite, solver, why)
    for solver, count in Counter(record.solver for record in extra if record not in old).items():
        yield Event(NOT_RUN, suite, solver, f"{_records(count)} of {solver} kept, not run")


def _records(count: int) -> str:
    return f"{count:,} record{'' if count == 1 else 's'}"


def missed_claims(suites: Sequence[str], folder: Path) -> list[str]:
    """Return a sentence for each false claim on record in the suites."""
    if "check" not in suites:
        return []
    checks = [record for record in RecordFile(folder).read().records if record.suite == "check"]
    failures = [record for record in checks if not np.all(record.measured.get("holds", True))]
    return [
        f"claim {record.problem!r} missed: {record.measured.get('failure', '')}"
        for record in failures
    ]


def forget(suites: Sequence[str], scale: str | Choice, folder: Path) -> None:
    """Remove the records of the blocks to measure; others stay.

    Raises:
        ValueError: if the result file cannot be read, or a run writes to it.
    """
    selected = {key for suite in suites for key in keys(suite, scale)}
    restarted = () if choice_at(scale).is_partial else suites
    with locked(folder):
        RecordFile(folder).drop(
            lambda record: (
                record.key in selected or (record.suite == FINISHED and record.problem in restarted)
            )
        )


def count(suites: Sequence[str], scale: str | Choice) -> int:
    """Return how many blocks there are, measured or not."""
    return sum(len(keys(suite, scale)) for suite in suites)


def keys(suite: str, scale: str | Choice) -> set[Key]:
    """Return the keys of the selected blocks of a suite."""
    choice = choice_at(scale)
    return set(map(block_key, filter(choice.takes, blocks(suite, choice.scale))))


def choice_at(scale: str | Choice) -> Choice:
    """Return everything at a scale by its name; a choice is returned as is."""
    return scale if isinstance(scale, Choice) else Choice(scale, SCALES[scale])


def why_again(block: Block, present: Mapping[Key, Record], executor: Executor) -> str | None:
    """Return why a block is measured again, "" without a record, None if its record is valid."""
    record = present.get(block_key(block))
    if record is None:
        return ""
    if record.failed:
        return "it failed before"
    if record.superseded:
        return "its settings are asked for again"
    if record.size < block.size:
        return "a larger size ({}, now {})".format(*distinct_texts(record.size, block.size))
    if record.measured.get("problem_digest") != block.facts.get("problem_digest"):
        return f"{block.problem} is another problem now"
    before, digest = record.measured.get("digest", ""), block.facts.get("digest", "")
    if before != digest:
        return f"other sources of {block.solver} ({before or 'none'}, now {digest or 'none'})"
    return executor.difference(block, record) or None
