"""Measure a block and make a record of its result, or of its failure."""

import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime

from ..peers.protocol import describe
from .block import Block, Measured
from .experiment import kind_of
from .machine import conditions, stamp
from .record import Key, Record, key
from .values import check_names


def block_key(block: Block) -> Key:
    """Return the key of a block's record."""
    return key(block.suite, block.problem, block.solver, block.settings)


def now() -> str:
    """Return the moment, ISO 8601, in UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def measure(block: Block) -> Record:
    """Measure a block; an exception becomes a record with the reason, and costs no other block."""
    return _records([block], lambda: [block.measure()])[0]


def measure_together(blocks: Sequence[Block]) -> list[Record]:
    """Measure the blocks of a group; an exception becomes the record of each."""
    groups = [block.group for block in blocks if block.group]
    return _records(blocks, lambda: groups[0].measure([group.job for group in groups]))


def _records(blocks: Sequence[Block], call: Callable[[], Sequence[Measured]]) -> list[Record]:
    """Return a record for each block of the results of a call."""
    begin = time.perf_counter()
    try:
        results = call()
    except Exception as error:  # an exception of a solver is its result
        if isinstance(error.__cause__, KeyboardInterrupt):  # Ctrl-C inside compiled code
            raise KeyboardInterrupt from None
        results = [failure(describe(error))] * len(blocks)
    seconds = (time.perf_counter() - begin) / len(blocks)
    return [_checked(*pair, seconds) for pair in zip(blocks, results, strict=True)]


def _checked(block: Block, measured: Measured, seconds: float) -> Record:
    """Return the record of a result; a result of another type than declared is a failure."""
    record = record_of(block, measured, seconds)
    try:
        record.check()
        if kind := kind_of(record.suite, record.task):
            check_names(kind, record.measured)
    except ValueError as error:
        return record_of(block, failure(describe(error)), seconds)
    return record


def failure(why: str) -> Measured:
    """Return the result of a block after a failed measurement."""
    return {"failed": why}


def not_installed(package: str) -> Measured:
    """Return the result of a block with a missing package."""
    return {"remark": f"{package} is not installed"}


def not_asked(why: str) -> Measured:
    """Return the result of a block that a solver cannot take."""
    return {"remark": why}


def record_of(block: Block, measured: Measured, seconds: float) -> Record:
    """Return the record of a result measured here and now."""
    return Record(
        block.suite,
        block.problem,
        block.solver,
        block.settings,
        {**block.facts, **measured},
        block.size,
        stamp(),
        now(),
        seconds,
        {**conditions(), **block.conditions},
    )
