"""What a worker of a cluster does: find a block by its key, measure it, return the record.

A block is measured in a process that the worker starts for it, as a solver may crash, print or
hang. Of all workers of a machine, one that takes times works while the others wait.
"""

import contextlib
import fcntl
import functools
import os
import socket
import tempfile
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ..experiments import Block, Scale, blocks
from ..harness.isolation import WorkerProcess
from ..harness.machine import difference, stamp
from ..harness.measure import block_key, measure
from ..harness.record import Key, check_regular, encode
from ..harness.worker import Calculation

# A block that says nothing for so long [s] is given up.
PATIENCE = 24 * 3600.0
_own = threading.local()


class Task(NamedTuple):
    """A block to be measured elsewhere.

    Attributes:
        suite: its suite.
        scale: how much is measured.
        key: the block's key.
        times: whether it is timed, so that nothing else may be measured meanwhile.
        stamp: that of the process that asks, whose versions and sources the worker must have.
    """

    suite: str
    scale: Scale
    key: Key
    times: bool
    stamp: Mapping[str, Any]


class Reply(NamedTuple):
    """What came of a task: a record as one line, or why there is none, or why it was refused."""

    line: str = ""
    failed: str = ""
    refused: str = ""


def perform(task: Task) -> Reply:
    """Measure a block in a process of its own."""
    if refused := unlike(task.stamp, stamp()):
        return Reply(refused=refused)
    try:
        with _machine_to_itself(task.times):
            found = _process().find(Calculation(measured, (task.suite, task.scale, task.key)))
    except RuntimeError as error:
        return Reply(failed=str(error))
    return Reply(**found)


def measured(suite: str, scale: Scale, key: Key) -> Mapping[str, str]:
    """Return the record of a block as a line, or that there is no such block here."""
    block = _blocks(suite, scale).get(key)
    if block is None:
        return {"refused": f"there is no block {', '.join(key)}; are the same files there?"}
    return {"line": encode(measure(block))}


def unlike(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> str:
    """Return in what versions or sources differ, "" if in nothing, on whatever machines."""
    return difference({**ours, "machine": {}}, {**theirs, "machine": {}})


def place() -> dict[str, Any]:
    """Return where this is: the name of the host, and the stamp of a record made here."""
    return {"host": socket.gethostname(), "stamp": stamp()}


@functools.cache
def _blocks(suite: str, scale: Scale) -> dict[Key, Block]:
    return {block_key(block): block for block in blocks(suite, scale)}


def _process() -> WorkerProcess:
    """Return the process of this thread."""
    if not hasattr(_own, "process"):
        _own.process = WorkerProcess(PATIENCE, PATIENCE)
    process: WorkerProcess = _own.process
    return process


@contextlib.contextmanager
def _machine_to_itself(whole: bool) -> Iterator[None]:
    """Hold a machine, the whole of it or a share; wait until it is to be had.

    A process that was killed holds nothing. Those that do not see each other's temporary folder,
    as in containers, do not see this either.
    """
    path = Path(tempfile.gettempdir(), f"plumbob-{os.getuid()}.lock")
    check_regular(path)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX if whole else fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)
