"""The work of a cluster's worker: find a block by its key, measure it, return its record.

Each block is measured in a process of its own, as a solver may crash, print or hang. While a
worker of a machine takes times, the other workers of that machine wait.
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
from typing import Any

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

# A block that is silent for so long [s] is given up.
PATIENCE = 24 * 3600.0
_of_thread = threading.local()


def perform(
    suite: str, scale: bytes, key: Key, times: bool, client: Mapping[str, Any], topic: str
) -> Mapping[str, str]:
    """Measure a block in a process of its own.

    Args:
        suite: its suite.
        scale: the pickled scale, with the user's solvers and problems.
        key: the block's key.
        times: whether it takes times, so that the machine must be idle otherwise.
        client: the stamp of the client; the worker must have the same versions and sources.
        topic: under which the client listens for progress.

    Returns:
        The record as a "line", or why it "failed" or was "refused".
    """
    if reason := unlike(client, stamp()):
        return {"refused": reason}
    if not hasattr(_of_thread, "process"):
        _of_thread.process = WorkerProcess(PATIENCE, PATIENCE)
    try:
        with _machine_to_itself(times), listening(partial(_report, topic)):
            reply: Mapping[str, str] = _of_thread.process.calculate(measured, suite, scale, key)
            return reply
    except RuntimeError as error:
        return {"failed": str(error)}


def _report(topic: str, progress: Progress) -> None:
    from distributed import get_worker

    get_worker().log_event(topic, list(progress))


def measured(suite: str, scale: bytes, key: Key) -> Mapping[str, str]:
    """Return the record of a block as a line, or why it is not measured here."""
    try:
        block = _blocks(suite, scale).get(key)
    except Exception as error:  # a user's file may raise anything
        return {"refused": describe(error)}
    if block is None:
        return {"refused": f"there is no block {', '.join(key)}"}
    return {"line": encode(measure(block))}


def unlike(client: Mapping[str, Any], worker: Mapping[str, Any]) -> str:
    """Return how versions or sources differ, "" if they do not, on whatever machines."""
    return difference({**client, "machine": {}}, {**worker, "machine": {}})


def place() -> dict[str, Any]:
    """Return the host of this worker, and the stamp of records made here."""
    return {"host": socket.gethostname(), "stamp": stamp()}


@functools.lru_cache(maxsize=32)
def _blocks(suite: str, pickled_scale: bytes) -> dict[Key, Block]:
    scale: Scale = pickle.loads(pickled_scale)
    for entrant in scale.entrants:
        if (digest := digest_of(entrant.spec)) != entrant.digest:
            files = f"other ones ({digest}, there {entrant.digest})" if digest else "none"
            raise ValueError(f"with: expected the files of {entrant.door}, got {files}")
    return {block_key(block): block for block in blocks(suite, scale)}


@contextlib.contextmanager
def _machine_to_itself(exclusive: bool) -> Iterator[None]:
    """Wait for a machine, the whole of it or a share, and hold it.

    The lock of a killed process is free. Containers with temporary folders of their own do not
    see each other's lock.
    """
    path = Path(tempfile.gettempdir(), f"plumbob-{os.getuid()}.lock")
    descriptor = open_lock(path, 0o600)
    try:
        if os.fstat(descriptor).st_uid != os.getuid():  # who could hold it for ever
            raise ValueError(f"{path}: expected a file of this user, got another user's")
        fcntl.flock(descriptor, fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)
