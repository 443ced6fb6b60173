"""Where blocks are measured, by its address: in this process, or by the workers of a cluster."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, NamedTuple

from ..block import Block, Scale
from ..machine import difference, stamp
from ..measure import measure, measure_together
from ..record import Record

LOCAL, DASK = "local", "dask://"


class NotMeasured(NamedTuple):
    """A block that could not be tried, and why; there is no record."""

    block: Block
    reason: str


Step = Block | Record | NotMeasured


class Executor:
    """Measure blocks in this process, in order; subclasses measure elsewhere."""

    def difference(self, block: Block, record: Record) -> str:
        """Return how a record differs from a measurement made now, "" if equal."""
        return difference(record.stamp, stamp())

    def measure(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Yield each block at its beginning, and its record or why there is none, in any order."""
        for name, members in groupby(blocks, lambda block: block.group and block.group.name):
            group = list(members)
            if name:
                yield from group
                yield from measure_together(group)
                continue
            for block in group:
                yield block
                yield measure(block)

    def stamp(self) -> Mapping[str, Any]:
        """Return the machine on which times are taken, versions and sources."""
        return stamp()

    def close(self) -> None:
        """Cancel the remaining measurements and release their resources."""


THIS_PROCESS = Executor()


def executor_at(address: str) -> Executor:
    """Return the executor of an address.

    Raises:
        ValueError: if the executor does not exist, needs a package that is not installed, or
            does not answer.
    """
    if address == LOCAL:
        return THIS_PROCESS
    scheduler = address.removeprefix(DASK)
    host, _, port = scheduler.rpartition(":")
    if scheduler == address or not (host and port.isdigit()):
        raise ValueError(f"--executor: expected local or dask://HOST:PORT, got {address!r}")
    from .dask import DaskExecutor

    return DaskExecutor(scheduler)
