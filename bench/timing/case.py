"""A case for the stopwatch: some work, done by us or by an engine, or the least it could cost."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..record import Key, key

TIMING = "timing"
# Before each line by which the process that takes the times tells what it does.
MARK = "plumbob\t"
# The same names in every subject, so that the tables find their columns.
COMPILED = "Plumbob, compiled"
PLAIN = "Plumbob, plain Python"
OURS = "Plumbob's kinematics"
LIMIT = "limit: copying as many bytes"


@dataclass(frozen=True)
class Case:
    """Work to be timed.

    Attributes:
        problem: what is done, such as "forward kinematics/10 balls".
        solver: by what.
        prepare: sets everything up and returns the call to be timed.
        operations: how many poses, solves or steps one call makes; times are for one.
        moved: bytes that one call reads and writes, where it is a limit of memory.
        speed: at which of the reference's speeds it runs.
    """

    problem: str
    solver: str
    prepare: Callable[[], Callable[[], Any]]
    operations: int = 1
    moved: int = 0
    speed: str = "compiled"

    @property
    def name(self) -> str:
        """Problem and solver in one."""
        return f"{self.problem}, {self.solver}"

    @property
    def key(self) -> Key:
        """The key of its record."""
        return key(TIMING, self.problem, self.solver, self.settings)

    @property
    def settings(self) -> dict[str, Any]:
        """What distinguishes it from another case of the same problem and solver."""
        return {"operations": self.operations}


def announce(state: str, case: Case, message: str = "") -> None:
    """Tell the process that waits what happens to a case."""
    line = "\t".join([state, case.name, " ".join(message.split())])
    print(f"{MARK}{line}", flush=True)


def copying(problem: str, size: int, *, passes: int = 1, operations: int = 1) -> Case:
    """Return the limit of memory: copies that read and write as many bytes, half and half.

    `size` bytes are moved in each pass, so that they come from as near a cache as the work's do.
    """
    prepare = partial(_copies, size // 16, passes)
    return Case(problem, LIMIT, prepare, operations, moved=size * passes)


def _copies(numbers: int, passes: int) -> Callable[[], None]:
    source, sink = np.ones(numbers), np.zeros(numbers)

    def run() -> None:
        for _ in range(passes):
            np.copyto(sink, source)

    return run
