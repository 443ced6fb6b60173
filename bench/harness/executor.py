"""Where blocks are measured: what a run asks of an executor, and the one that is this process."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from .block import Block, Scale
from .machine import difference, stamp
from .measure import measure
from .record import Record


class NotMeasured(NamedTuple):
    """A block that could not even be tried, and why: there is no record of it."""

    block: Block
    why: str


Step = Block | Record | NotMeasured


class Executor:
    """Where blocks are measured: in this process, one after the other, but for subclasses.

    Attributes:
        takes_suites_together: whether the blocks of all suites are best given at once.
    """

    takes_suites_together = False

    def look_at(self, timed: Iterable[Record | None]) -> None:
        """Take note of what is on record of all blocks that take times, asked for or not."""

    def difference(self, block: Block, record: Record) -> str:
        """Return in what a record differs from what would be measured now, "" if in nothing."""
        return difference(record.stamp, stamp())

    def measure(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Yield each block as it is begun, and what came of it, in any order."""
        for block in blocks:
            yield block
            yield measure(block)

    def stamp(self) -> Mapping[str, Any]:
        """Return the machine that times are taken on, versions and sources."""
        return stamp()

    def close(self) -> None:
        """Give up what is still to be measured, and whatever is held for it."""


THIS_PROCESS = Executor()
