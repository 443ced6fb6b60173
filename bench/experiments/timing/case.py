"""A case for the stopwatch: some work, done by us or by an engine, or a plain copy of its bytes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.backend.threads import in_slices

from ...peers import catalogue

COMPILED, PREPARED = catalogue.COMPILED.name, catalogue.PREPARED.name
PLAIN, LIMIT = catalogue.PLAIN.name, catalogue.LIMIT.name
PRESET, TIGHT = catalogue.PRESET.name, catalogue.TIGHT.name


class TimedWork(NamedTuple):
    """Work to be timed with every implementation."""

    problem: str  # the name in the records
    subject: str  # kinematics, ik or cloth: each has a table and a figure
    group: str  # the model that the work is done on, such as "10 balls"
    title: str  # the name of the work within its group

    @property
    def facts(self) -> dict[str, str]:
        """The names, as facts of a block."""
        title = f"{self.group}, {self.title}"
        return {"subject": self.subject, "group": self.group, "work": self.title, "title": title}


@dataclass(frozen=True)
class TimedCase:
    """Work to be timed with an implementation."""

    work: TimedWork
    solver: str  # the implementation
    prepare: Callable[[], Callable[[], Any]]  # sets up and returns the call to be timed
    operations: int = 1  # poses, solves or steps of one call; times are for one
    moved: int = 0  # bytes that one call reads and writes, for a yardstick of memory
    backend: str = "numba"  # of the reference
    cores: int | None = 1  # None for all
    error: Callable[[], float] | None = None  # of the result, where it depends on a tolerance

    @property
    def name(self) -> str:
        """Problem and solver."""
        return f"{self.work.problem}, {self.solver}"


def copying(work: TimedWork, size: int, *, passes: int = 1, operations: int = 1) -> TimedCase:
    """Return a yardstick of memory: copies that read and write as many bytes, half and half.

    Each pass moves `size` bytes, from as near a cache as the bytes of the work.
    """
    prepare = partial(_copies, size // 16, passes)
    return TimedCase(work, LIMIT, prepare, operations, moved=size * passes)


def _copies(numbers: int, passes: int) -> Callable[[], None]:
    source, sink = np.ones(numbers), np.zeros(numbers)

    def run() -> None:
        for _ in range(passes):
            np.copyto(sink, source)

    return run


def streaming(
    work: TimedWork, read: int, write: int, *, operations: int = 1,
    cores: int | None = 1, minimum: int = 0,
) -> TimedCase:  # fmt: skip
    """Return a yardstick of memory: a compiled loop that reads and writes so many bytes.

    A processor reads memory before writing (write-allocate), which counts as moved. On several
    cores the loop is cut into slices of at least `minimum` bytes to read.
    """
    prepare = partial(_streams, read // 8, write // 8, minimum // 8)
    return TimedCase(work, LIMIT, prepare, operations, read + 2 * write, cores=cores)


def stream(source: FloatArray, sink: FloatArray) -> None:
    """Fill a sink, longer than the source: the source plus 1, then 1 to the end."""
    for i in range(len(source)):
        sink[i] = source[i] + 1.0
    for i in range(len(source), len(sink)):
        sink[i] = 1.0


_stream = Kernel(stream)


def _streams(read: int, write: int, minimum: int) -> Callable[[], Any]:
    source, sink = np.ones(read), np.zeros(write)

    def share(part: slice) -> tuple[np.ndarray, np.ndarray]:
        return source[part], sink[part.start * write // read : part.stop * write // read]

    if minimum == 0:
        return partial(_stream, source, sink)
    return partial(in_slices, _stream, read, share, minimum=minimum)
