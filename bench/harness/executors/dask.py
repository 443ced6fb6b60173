"""The workers of a Dask cluster: timed blocks are pinned, all others spread over them.

Dask finds a worker for each block without times, and another if that is lost. Timed blocks are
placed here: a suite stays on a host, block after block, and on hosts of a single machine, unless
machines may be mixed.
"""

import asyncio
import contextlib
import json
import logging
import pickle
import uuid
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

from ...peers.stopwatch import Patience
from ..block import Block, Scale
from ..machine import stamp
from ..measure import block_key, failure, record_of
from ..progress import Progress, announce
from ..record import Record, decode
from . import DASK, Executor, NotMeasured, Step
from .work import perform, place, unlike

# How long [s] to wait for the scheduler, and for workers, at first and when all are lost.
ANSWER, WORKERS = 10.0, 120.0
# How often [s] to look which workers are there.
_LOOK = 1.0
_NO_EXTRA = (
    "--executor: expected the package distributed, which is not installed: "
    "pip install '.[cluster]', on the workers as well"
)


class Place(NamedTuple):
    """The host and the machine of a worker, the machine as JSON."""

    host: str
    machine: str


@dataclass(eq=False)
class _Queue:
    """Blocks to be measured in order, pinned to a host if they take times."""

    blocks: deque[Block]  # the remaining blocks
    is_pinned: bool  # whether they stay on a host
    # whether the first was reported as begun; another worker may begin it again
    is_begun: bool = False
    host: str = ""  # the host that they are bound to, if any
    address: str = ""  # the worker that has the first block
    future: Any = None  # the result of the first block, None if no worker has it


class DaskExecutor(Executor):
    """The workers of a cluster.

    Attributes:
        address: host and port of the scheduler.
        mix_machines: whether times of several machines may share a table.
    """

    takes_suites_together = True

    def __init__(
        self,
        address: str,
        mix_machines: bool = False,
        answer: float = ANSWER,
        workers: float = WORKERS,
    ) -> None:
        """Connect to a scheduler and wait for its first worker.

        Raises:
            ValueError: if Dask is not installed, the scheduler does not answer in time [s], there
                is no worker in time [s], or a worker has other versions or sources.
        """
        self.address, self.mix_machines, self._patience = address, mix_machines, workers
        self._client, self._results = _connected(address, answer), SimpleQueue[Any]()
        self._topic = f"plumbob-{uuid.uuid4().hex}"
        self._client.subscribe_topic(
            self._topic, lambda event: self._results.put(Progress(*event[1]))
        )
        self._places: dict[str, Place] = {}
        self._machine, self._records = "", list[Record]()
        try:
            self._wait_for_workers()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the cluster; cancel our remaining measurements."""
        self._client.close(timeout=ANSWER)

    def note_records(self, records: Iterable[Record | None]) -> None:
        """Choose the machine that times are taken on: the available one with the most records."""
        self._records = [
            record
            for record in records
            if record and record.arrays and not unlike(record.stamp, stamp())
        ]
        recorded = Counter(_machine(record.stamp) for record in self._records)
        workers = Counter(place.machine for place in self._places.values())
        self._machine = max(sorted(workers), key=lambda name: (recorded[name], workers[name]))

    def difference(self, block: Block, record: Record) -> str:
        """Return how a record was made differently; the machine matters for times only."""
        if block.times and not self.mix_machines and _machine(record.stamp) != self._machine:
            return f"times are taken on another machine ({_in_words(self._machine)})"
        return unlike(record.stamp, stamp())

    def stamp(self) -> Mapping[str, Any]:
        """Return the machine that times are taken on, versions and sources."""
        return {**stamp(), "machine": json.loads(self._machine)}

    def measure(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Yield each block when it is submitted, and its record when it arrives."""
        untimed = [_Queue(deque([block]), False) for block in blocks if not block.times]
        yield from self._measure(untimed, scale)
        timed_blocks = [block for block in blocks if block.times]
        mixed = self._mixed_suites(timed_blocks)
        yield from (NotMeasured(b, mixed[b.suite]) for b in timed_blocks if b.suite in mixed)
        queues: dict[Any, _Queue] = {}
        for i, block in enumerate(timed_blocks):
            if block.suite not in mixed:
                name = i if self.mix_machines else block.suite
                queues.setdefault(name, _Queue(deque(), True)).blocks.append(block)
        yield from self._measure(list(queues.values()), scale)

    def _mixed_suites(self, blocks: Sequence[Block]) -> dict[str, str]:
        """Return the suites with remaining rows of another machine, and why that is bad."""
        keys, machine = {block_key(block) for block in blocks}, _in_words(self._machine)
        return {
            record.suite: f"others of {record.suite} are timed on another machine than is here "
            f"({_in_words(_machine(record.stamp))}; here {machine}): ask for the whole suite, or "
            "--mix-machines"
            for record in self._records
            if not (self.mix_machines or record.key in keys)
            and _machine(record.stamp) != self._machine
        }

    def _measure(self, queues: list[_Queue], scale: Scale) -> Iterator[Step]:
        """Measure the blocks of all queues, each queue in order."""
        patience = Patience(self._patience)
        while queues := [queue for queue in queues if queue.blocks]:
            yield from self._submit_first_blocks(queues, scale)
            future, addresses = self._next(), self._addresses()
            self._release_lost_workers(queues, addresses)
            if addresses and any(queue.future for queue in queues):
                patience = Patience(self._patience)
            elif patience.is_spent:
                if not queues[0].is_pinned:
                    raise self._error(f"no worker is left for {self._patience:g} s")
                why = f"no worker on the machine that takes times ({_in_words(self._machine)})"
                yield from (NotMeasured(b, why) for queue in queues for b in queue.blocks)
                return
            queue = next((q for q in queues if future and q.future is future), None)
            if queue and (record := self._record(queue.blocks[0], future)) is not None:
                queue.blocks.popleft()
                queue.future, queue.is_begun = None, False
                yield record

    def _submit_first_blocks(self, queues: Sequence[_Queue], scale: Scale) -> Iterator[Block]:
        """Submit the first block of each queue, if pinned to a host without another queue."""
        for queue in queues:
            if queue.future:
                continue
            workers: dict[str, Any] = {}
            if queue.is_pinned:
                occupied = {other.host for other in queues if other is not queue}
                address = self._free_worker(queue.host, occupied)
                if not address:
                    continue
                queue.host, queue.address = self._places[address].host, address
                workers = {"workers": [address]}
            if not queue.is_begun:
                yield queue.blocks[0]
            block, name = queue.blocks[0], f"plumbob-{uuid.uuid4().hex}"
            arguments = block.suite, pickle.dumps(scale), block_key(block), block.times, stamp()
            future = self._client.submit(perform, *arguments, self._topic, key=name, **workers)
            future.add_done_callback(self._results.put)
            queue.is_begun, queue.future = True, future

    def _free_worker(self, host: str, occupied: set[str]) -> str:
        """Return a worker of this host, or of any free host if it is ""; "" if there is none."""
        for address in self._addresses():
            place = self._places[address]
            is_allowed = self.mix_machines or place.machine == self._machine
            if is_allowed and (place.host == host if host else place.host not in occupied):
                return address
        return ""

    def _release_lost_workers(self, queues: Sequence[_Queue], addresses: Sequence[str]) -> None:
        """Take back the block of a lost worker, and unbind its queue from a host that is gone."""
        hosts = {self._places[address].host for address in addresses}
        for queue in queues:
            if queue.is_pinned and queue.future and queue.address not in addresses:
                queue.future.cancel()
                queue.future = None
            if queue.host not in hosts:
                queue.host = ""

    def _next(self) -> Any:
        """Return a future that is done, None if there is none for a while; pass on progress."""
        with contextlib.suppress(Empty):
            result = self._results.get(timeout=_LOOK)
            if not isinstance(result, Progress):
                return result
            announce(*result)
        return None

    def _record(self, block: Block, future: Any) -> Record | None:
        """Return the record of a block, None if its worker was lost with it."""
        from distributed import KilledWorker

        try:
            reply: Mapping[str, str] = future.result(timeout=ANSWER)
        except TimeoutError:
            self._results.put(future)
            return None
        except KilledWorker:
            reply = {"failed": "every worker that tried it was lost"}
        except asyncio.CancelledError:
            raise self._error("the scheduler is gone") from None
        except Exception as error:
            raise self._error(f"{type(error).__name__}: {error}") from None
        if "refused" in reply:
            raise self._error(reply["refused"])
        if "failed" in reply:
            return replace(record_of(block, failure(reply["failed"]), 0.0), stamp=self.stamp())
        return decode(reply["line"])

    def _wait_for_workers(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=self._patience)
        except TimeoutError:
            why = f"expected a worker, got none within {self._patience:g} s"
            raise self._error(why) from None
        while not self._addresses():
            pass

    def _addresses(self) -> list[str]:
        """Return the addresses of the present workers, in order; inspect new workers.

        Raises:
            ValueError: if a worker has other versions or sources.
        """
        try:
            addresses = sorted(self._client.nthreads())
            if new := [address for address in addresses if address not in self._places]:
                replies = self._client.run(place, workers=new, on_error="return")
                self._places |= {at: _place(at, reply) for at, reply in replies.items()}
        except (OSError, RuntimeError, TimeoutError):
            raise self._error("the scheduler is gone") from None
        return [address for address in addresses if address in self._places]

    def _error(self, message: str) -> ValueError:
        return ValueError(f"{DASK}{self.address}: {message}")


def _place(address: str, reply: Any) -> Place:
    """Return the place of a worker, which must have our versions and sources."""
    if isinstance(reply, ImportError):
        raise ValueError(f"worker {address}: expected Plumbob, got {reply}")
    if isinstance(reply, Exception):
        raise reply
    if why := unlike(stamp(), reply["stamp"]):
        raise ValueError(f"worker {address}: expected what is installed here, got {why}")
    return Place(reply["host"], _machine(reply["stamp"]))


def _connected(address: str, patience: float) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(_NO_EXTRA) from None
    for name in ("distributed", "distributed.client", "asyncio"):  # we report their errors
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        if asyncio.run(asyncio.wait_for(_identity(address), patience)).get("type") != "Scheduler":
            raise ValueError
        return Client(address, timeout=patience, set_as_default=False, name="plumbob")
    except (OSError, TimeoutError):
        why = f"got no answer within {patience:g} s"
    except Exception:  # reading another program's answer may raise anything
        why = "got an answer of something else"
    raise ValueError(f"{DASK}{address}: expected a Dask scheduler, {why}")


async def _identity(address: str) -> Mapping[str, Any]:
    """Return the identity of a Dask process; a Client would wait for it without a limit."""
    from distributed.core import rpc
    from distributed.security import Security

    async with rpc(address, connection_args=Security().get_connection_args("client")) as process:
        identity: Mapping[str, Any] = await process.identity()
        return identity


def _machine(stamp: Mapping[str, Any]) -> str:
    """Return the machine of a stamp as JSON, which can be compared and counted."""
    return json.dumps(dict(stamp.get("machine", {})), sort_keys=True)


def _in_words(machine: str) -> str:
    return ", ".join(str(part) for part in json.loads(machine).values())
