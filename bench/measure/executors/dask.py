"""The workers of a Dask cluster: any worker answers, a single worker takes all times."""

import asyncio
import functools
import json
import logging
import pickle
import threading
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...clock import time_limit
from ...peers.protocol import describe
from ...peers.sources import digest_of
from ..block import Block, Scale
from ..experiment import blocks
from ..isolation import WorkerProcess
from ..machine import difference, stamp
from ..measure import block_key, failure, measure, record_of
from ..record import Key, Record, decode, encode
from . import DASK, Executor, NotMeasured, Step

# How long [s] to wait for the scheduler, and for workers, at first and when all are lost.
ANSWER, WORKERS = 10.0, 120.0
# How often [s] to look for results and workers.
_LOOK = 1.0
# A block silent for this long [s] is given up.
_SILENCE = 24 * 3600.0
_of_thread = threading.local()


class DaskExecutor(Executor):
    """The workers of a cluster, at the address of its scheduler: host and port."""

    def __init__(self, address: str, answer: float = ANSWER, workers: float = WORKERS) -> None:
        """Connect to a scheduler, and choose the worker that takes times.

        Raises:
            ValueError: if Dask is not installed, the scheduler does not answer in time [s], or
                there is no worker in time [s].
        """
        self.address, self._patience = address, workers
        self._client = _connected(address, answer)
        try:
            self._client.wait_for_workers(1, timeout=workers)
        except TimeoutError:
            self.close()
            raise self._error(f"expected a worker, got none within {workers:g} s") from None
        # Times come from the kind of machine of most workers, and from the first of these.
        machines = {at: json.dumps(machine) for at, machine in self._client.run(_machine).items()}
        counts = Counter(machines.values())
        self._timer = min(machines, key=lambda at: (-counts[machines[at]], machines[at], at))
        self._machine = json.loads(machines[self._timer])

    def close(self) -> None:
        """Leave the cluster; cancel our remaining measurements."""
        self._client.close(timeout=ANSWER)

    def difference(self, block: Block, record: Record) -> str:
        """Return how a record was made differently; the machine matters for times only."""
        return difference(record.stamp, self.stamp() if block.times else _of_any_machine(record))

    def stamp(self) -> Mapping[str, Any]:
        """Return the machine that takes times, with our versions and sources."""
        return {**stamp(), "machine": self._machine}

    def measure(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Yield each block when submitted, and its record on arrival.

        Times are taken when all answers are there, block after block.
        """
        yield from self._measure([block for block in blocks if not block.times], scale)
        for block in blocks:
            if block.times and self._timer in self._client.nthreads():
                yield from self._measure([block], scale, workers=[self._timer])
            elif block.times:
                yield NotMeasured(block, f"the worker that takes times, {self._timer}, is lost")

    def _measure(self, blocks: Sequence[Block], scale: Scale, **options: Any) -> Iterator[Step]:
        yield from blocks
        limits, client = pickle.dumps(scale), _of_any_machine()
        futures = {
            self._client.submit(
                perform, block.suite, limits, block_key(block), client, pure=False, **options
            ): block
            for block in blocks
        }
        for future in self._completed(futures):
            yield self._record(futures[future], future)

    def _completed(self, futures: Mapping[Any, Block]) -> Iterator[Any]:
        """Yield futures as they complete; Dask repeats the block of a lost worker on another."""
        from distributed import wait

        left, is_over = set(futures), time_limit(self._patience)
        while left:
            try:
                with self._client.as_current():
                    completed = wait(left, timeout=_LOOK, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                completed = set()
            if completed or self._client.nthreads():
                is_over = time_limit(self._patience)
            elif is_over():
                raise self._error(f"no worker is left for {self._patience:g} s")
            yield from completed
            left -= completed

    def _record(self, block: Block, future: Any) -> Record:
        from distributed import KilledWorker

        try:
            reply: Mapping[str, str] = future.result(timeout=ANSWER)
        except KilledWorker:
            reply = {"failed": "every worker that tried it was lost"}
        except Exception as error:
            raise self._error(f"{type(error).__name__}: {error}") from None
        if "refused" in reply:
            raise self._error(reply["refused"])
        if "failed" in reply:
            return replace(record_of(block, failure(reply["failed"]), 0.0), stamp=self.stamp())
        return decode(reply["line"])

    def _error(self, message: str) -> ValueError:
        return ValueError(f"{DASK}{self.address}: {message}")


def _connected(address: str, patience: float) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(
            "--executor: expected the package distributed, which is not installed: "
            "pip install '.[cluster]', on the workers as well"
        ) from None
    for name in ("distributed", "distributed.client", "asyncio"):  # we report their errors
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        asyncio.run(asyncio.wait_for(_identify(address), patience))
        return Client(address, timeout=patience, set_as_default=False, name="plumbob")
    except Exception:  # reading another program's answer may raise anything
        why = f"got no answer of one within {patience:g} s"
    raise ValueError(f"{DASK}{address}: expected a Dask scheduler, {why}")


async def _identify(address: str) -> None:
    """Raise an exception if no scheduler answers; a Client would wait without a limit."""
    from distributed.core import rpc
    from distributed.security import Security

    async with rpc(address, connection_args=Security().get_connection_args("client")) as process:
        if (await process.identity())["type"] != "Scheduler":
            raise ValueError(address)


def _machine() -> Mapping[str, Any]:
    return stamp()["machine"]


def _of_any_machine(record: Record | None = None) -> Mapping[str, Any]:
    """Return our versions and sources, with the machine of a record or none."""
    return {**stamp(), "machine": record.stamp["machine"] if record else {}}


def perform(suite: str, scale: bytes, key: Key, client: Mapping[str, Any]) -> Mapping[str, str]:
    """Measure a block on a worker, in a process of its own: a solver may crash or hang.

    Returns:
        The record as a "line", or why it "failed", or was "refused" because the worker has other
        versions or sources than the client, or other files of the user's solver.
    """
    if reason := difference(client, _of_any_machine()):
        return {"refused": f"expected a worker with what is installed here, got {reason}"}
    if not hasattr(_of_thread, "process"):
        _of_thread.process = WorkerProcess(_SILENCE, _SILENCE)
    try:
        reply: Mapping[str, str] = _of_thread.process.calculate(measured, suite, scale, key)
        return reply
    except RuntimeError as error:
        return {"failed": str(error)}


def measured(suite: str, scale: bytes, key: Key) -> Mapping[str, str]:
    """Return the record of a block as a line, or why the block is not measured here."""
    try:
        block = _blocks(suite, scale).get(key)
    except Exception as error:  # a user's file may raise anything
        return {"refused": describe(error)}
    if block is None:
        return {"refused": f"there is no block {', '.join(key)}"}
    return {"line": encode(measure(block))}


@functools.lru_cache(maxsize=32)
def _blocks(suite: str, pickled_scale: bytes) -> dict[Key, Block]:
    scale: Scale = pickle.loads(pickled_scale)
    for solver in scale.user_solvers:
        if (digest := digest_of(solver.spec)) != solver.digest:
            files = f"other ones ({digest}, there {solver.digest})" if digest else "none"
            raise ValueError(f"with: expected the files of {solver.address}, got {files}")
    return {block_key(block): block for block in blocks(suite, scale)}
