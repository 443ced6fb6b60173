"""A case for the stopwatch: some work, done by us or by an engine, or a plain copy of its bytes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.backend.compiled import Kernel
from plumbob.reference.backend.threads import in_slices

from ...peers import registry

COMPILED, PLAIN, LIMIT = registry.COMPILED.name, registry.PLAIN.name, registry.LIMIT.name
OURS = registry.OUR_KINEMATICS.name


class Work(NamedTuple):
    """What is to be timed, whoever does it.

    Attributes:
        problem: the name in the records.
        subject: kinematics, ik or cloth: each has a table and a figure.
        group: what the work is done on, such as "10 balls".
        title: how the work is written within its group.
    """

    problem: str
    subject: str
    group: str
    title: str

    @property
    def facts(self) -> dict[str, str]:
        """What the names say, as values."""
        written = f"{self.group}, {self.title}"
        return {"subject": self.subject, "group": self.group, "work": self.title, "title": written}


@dataclass(frozen=True)
class Case:
    """Work to be timed.

    Attributes:
        work: what is done.
        solver: by what.
        prepare: sets everything up and returns the call to be timed.
        operations: how many poses, solves or steps one call makes; times are for one.
        moved: bytes that one call reads and writes, where it is a yardstick of memory.
        backend: by which of the reference's backends it runs.
        cores: on how many of them; None is all that there are.
    """

    work: Work
    solver: str
    prepare: Callable[[], Callable[[], Any]]
    operations: int = 1
    moved: int = 0
    backend: str = "numba"
    cores: int | None = 1

    @property
    def name(self) -> str:
        """Problem and solver in one."""
        return f"{self.work.problem}, {self.solver}"


def copying(work: Work, size: int, *, passes: int = 1, operations: int = 1) -> Case:
    """Return a yardstick of memory: copies that read and write as many bytes, half and half.

    `size` bytes are moved in each pass, so that they come from as near a cache as the work's do.
    """
    prepare = partial(_copies, size // 16, passes)
    return Case(work, LIMIT, prepare, operations, moved=size * passes)


def streaming(
    work: Work, read: int, written: int, *, operations: int = 1,
    cores: int | None = 1, least: int = 0,
) -> Case:  # fmt: skip
    """Return a yardstick of memory: a compiled loop that reads and writes so many bytes.

    A processor reads what it is about to write (write-allocate), which counts as moved. On several
    cores the loop is cut into slices that read at least `least` bytes each.
    """
    prepare = partial(_streams, read // 8, written // 8, least // 8)
    return Case(work, LIMIT, prepare, operations, read + 2 * written, cores=cores)


def stream(source: FloatArray, sink: FloatArray) -> None:
    """Fill a sink, longer than the source, by adding one to each number and going on with ones."""
    for i in range(len(source)):
        sink[i] = source[i] + 1.0
    for i in range(len(source), len(sink)):
        sink[i] = 1.0


_stream = Kernel(stream)


def _streams(read: int, written: int, least: int) -> Callable[[], Any]:
    source, sink = np.ones(read), np.zeros(written)

    def share(part: slice) -> tuple[np.ndarray, np.ndarray]:
        return source[part], sink[part.start * written // read : part.stop * written // read]

    if least == 0:
        return partial(_stream, source, sink)
    return partial(in_slices, _stream, read, share, least=least)


def _copies(numbers: int, passes: int) -> Callable[[], None]:
    source, sink = np.ones(numbers), np.zeros(numbers)

    def run() -> None:
        for _ in range(passes):
            np.copyto(sink, source)

    return run
