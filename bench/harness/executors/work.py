"""What a worker of a cluster does: find a block by its key, measure it, return the record.

A block is measured in a process that the worker starts for it, as a solver may crash, print or
hang. Of all workers of a machine, one that takes times works while the others wait.
"""

import contextlib
import fcntl
import functools
import os
import pickle
import socket
import tempfile
import threading
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ...peers.entrant import Entrant
from ...peers.protocol import describe
from ...peers.sources import digest_of
from ..block import Block, Scale
from ..experiment import blocks
from ..folder_lock import open_lock
from ..isolation import WorkerProcess
from ..machine import difference, stamp
from ..measure import block_key, measure
from ..progress import Progress, listening
from ..record import Key, encode
from ..worker import Calculation

# A block that says nothing for so long [s] is given up.
PATIENCE = 24 * 3600.0


class _Own(threading.local):
    """The process of a thread."""

    def __init__(self) -> None:
        self.process = WorkerProcess(PATIENCE, PATIENCE)


_own = _Own()


class Task(NamedTuple):
    """A block to be measured elsewhere.

    Attributes:
        suite: its suite.
        scale: how much is measured, and whose solvers and problems take part, pickled.
        key: the block's key.
        times: whether it is timed, so that nothing else may be measured meanwhile.
        stamp: that of the process that asks, whose versions and sources the worker must have.
        topic: the events under which that process hears what is being done.
    """

    suite: str
    scale: bytes
    key: Key
    times: bool
    stamp: Mapping[str, Any]
    topic: str = ""


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
        with _machine_to_itself(task.times), listening(partial(_tell, task.topic)):
            found = _own.process.find(Calculation(measured, (task.suite, task.scale, task.key)))
    except RuntimeError as error:
        return Reply(failed=str(error))
    return Reply(**found)


def _tell(topic: str, progress: Progress) -> None:
    from distributed import get_worker

    get_worker().log_event(topic, list(progress))


def measured(suite: str, scale: bytes, key: Key) -> Mapping[str, str]:
    """Return the record of a block as a line, or why it is not measured here."""
    try:
        block = _blocks(suite, scale).get(key)
    except Exception as error:  # whatever files of a user's may raise
        return {"refused": describe(error)}
    if block is None:
        return {"refused": f"there is no block {', '.join(key)}"}
    return {"line": encode(measure(block))}


def unlike(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> str:
    """Return in what versions or sources differ, "" if in nothing, on whatever machines."""
    return difference({**ours, "machine": {}}, {**theirs, "machine": {}})


def place() -> dict[str, Any]:
    """Return where this is: the name of the host, and the stamp of a record made here."""
    return {"host": socket.gethostname(), "stamp": stamp()}


@functools.lru_cache(maxsize=32)
def _blocks(suite: str, scale: bytes) -> dict[Key, Block]:
    made: Scale = pickle.loads(scale)
    for entrant in made.entrants:
        _check_files(entrant)
    return {block_key(block): block for block in blocks(suite, made)}


def _check_files(entrant: Entrant) -> None:
    """Raise unless the files of a user's solver are here as they are there."""
    if (digest := digest_of(entrant.spec)) != entrant.digest:
        found = f"other ones ({digest}, there {entrant.digest})" if digest else "none"
        raise ValueError(f"with: expected the files of {entrant.door}, got {found}")


@contextlib.contextmanager
def _machine_to_itself(whole: bool) -> Iterator[None]:
    """Hold a machine, the whole of it or a share; wait until it is to be had.

    A process that was killed holds nothing. Those that do not see each other's temporary folder,
    as in containers, do not see this either.
    """
    path = Path(tempfile.gettempdir(), f"plumbob-{os.getuid()}.lock")
    descriptor = open_lock(path, 0o600)
    try:
        if os.fstat(descriptor).st_uid != os.getuid():  # who could hold it for ever
            raise ValueError(f"{path}: expected a file of this user, got another user's")
        fcntl.flock(descriptor, fcntl.LOCK_EX if whole else fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)
