"""The workers of a Dask cluster: what takes no times spreads over them, what does is pinned.

Dask finds a worker for each block that takes no times, and another one if that is lost. Blocks that
take times are given out here: those of a suite to one host, one after the other, and hosts of one
machine only, unless machines may be mixed.
"""

import asyncio
import contextlib
import json
import logging
import pickle
import queue
import uuid
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..block import Block, Scale
from ..executor import Executor, NotMeasured, Step
from ..machine import stamp
from ..measure import block_key, failure, record_of
from ..progress import Progress, announce
from ..record import Record, decode
from ..stopwatch import Budget
from . import DASK
from .work import Reply, Task, perform, place, unlike

# So long [s] is waited for the scheduler, and for workers, at first and when all are lost.
ANSWER, WORKERS = 10.0, 120.0
# So often [s] it is asked which workers are still there.
_LOOK = 1.0
_NO_EXTRA = (
    "--executor: expected the package distributed, which is not installed: "
    "pip install -e .[cluster], on the workers as well"
)


class Place(NamedTuple):
    """A worker.

    Attributes:
        address: where Dask finds it.
        host: the name of its host.
        stamp: machine, versions and sources.
    """

    address: str
    host: str
    stamp: Mapping[str, Any]

    @property
    def machine(self) -> str:
        """The kind of machine, as records know it."""
        return _machine(self.stamp)


@dataclass(eq=False)
class _Line:
    """Blocks that one host measures one after the other.

    Attributes:
        blocks: those that are not done.
        told: whether the first was said to be begun; it may be begun again elsewhere.
        host: the host that they are bound to, while there is one.
        address: the worker that has the first block.
        future: what will come of it, None if no worker has it.
    """

    blocks: deque[Block]
    told: bool = False
    host: str = ""
    address: str = ""
    future: Any = None


class DaskExecutor(Executor):
    """The workers of a cluster.

    Attributes:
        address: host and port of the scheduler.
        mix_machines: whether times of several machines may stand in one table.
    """

    takes_suites_together = True

    def __init__(
        self,
        address: str,
        mix_machines: bool = False,
        answer: float = ANSWER,
        workers: float = WORKERS,
    ) -> None:
        """Connect to a scheduler, and see who works there.

        Raises:
            ValueError: if Dask is not installed, the scheduler does not answer in time [s], there
                is no worker in time [s], or one has other versions or sources.
        """
        self.address, self.mix_machines, self._patience = address, mix_machines, workers
        self._client, self._done = _connected(address, answer), queue.SimpleQueue[Any]()
        self._topic = f"plumbob-{uuid.uuid4().hex}"
        self._client.subscribe_topic(self._topic, self._heard)
        self._places: dict[str, Place] = {}
        self._machine, self._timed = "", list[Record]()
        try:
            self._wait_for_workers()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the cluster; what is still to be measured for us is given up."""
        self._client.close(timeout=ANSWER)

    def look_at(self, timed: Iterable[Record | None]) -> None:
        """Choose the machine that times are taken on: of those here, that of the most records."""
        self._timed = [
            record
            for record in timed
            if record and record.arrays and not unlike(record.stamp, stamp())
        ]
        records = Counter(_machine(record.stamp) for record in self._timed)
        workers = Counter(one.machine for one in self._places.values())
        self._machine = max(sorted(workers), key=lambda name: (records[name], workers[name]))

    def difference(self, block: Block, record: Record) -> str:
        """Return in what a record was made otherwise; what machine matters for times only."""
        if block.times and not self.mix_machines and _machine(record.stamp) != self._machine:
            return f"times are taken on another machine ({_in_words(self._machine)})"
        return unlike(record.stamp, stamp())

    def stamp(self) -> Mapping[str, Any]:
        """Return the machine that times are taken on, versions and sources."""
        return {**stamp(), "machine": json.loads(self._machine)}

    def measure(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Yield each block as it is given out, and what came of it, as it comes."""
        yield from self._spread([block for block in blocks if not block.times], scale)
        timed = [block for block in blocks if block.times]
        mixed = self._would_be_mixed(timed)
        yield from (NotMeasured(b, mixed[b.suite]) for b in timed if b.suite in mixed)
        yield from self._pin([block for block in timed if block.suite not in mixed], scale)

    def _would_be_mixed(self, blocks: Sequence[Block]) -> dict[str, str]:
        """Return the suites of which rows that stay are of another machine, and why that is bad."""
        again, here = {block_key(block) for block in blocks}, _in_words(self._machine)
        return {
            record.suite: f"others of {record.suite} are timed on another machine than is here "
            f"({_in_words(_machine(record.stamp))}; here {here}): ask for the whole suite, or "
            "--mix-machines"
            for record in self._timed
            if not (self.mix_machines or record.key in again)
            and _machine(record.stamp) != self._machine
        }

    def _spread(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Let Dask choose the workers."""
        given = {}
        for block in blocks:
            yield block
            future = self._submit(block, scale)
            given[future.key] = block, future
        patience = Budget(self._patience)
        while given:
            future = self._next()
            if self._here():
                patience = Budget(self._patience)
            elif patience.is_spent:
                raise ValueError(self._says(f"no worker is left for {self._patience:g} s"))
            if future is not None and future.key in given:
                found = self._outcome(given[future.key][0], future)
                if found is not None:
                    del given[future.key]
                    yield found

    def _pin(self, blocks: Sequence[Block], scale: Scale) -> Iterator[Step]:
        """Give each host a line of blocks, one block after the other."""
        lines, patience = self._lines(blocks), Budget(self._patience)
        while lines := [line for line in lines if line.blocks]:
            yield from self._give_out(lines, scale)
            if any(line.future for line in lines):
                patience = Budget(self._patience)
            elif patience.is_spent:
                why = f"no worker on the machine that takes times ({_in_words(self._machine)})"
                yield from (NotMeasured(b, why) for line in lines for b in line.blocks)
                return
            future = self._next()
            self._leave_lost_workers(lines)
            line = next((line for line in lines if line.future and line.future is future), None)
            if line and (found := self._outcome(line.blocks[0], future)) is not None:
                line.blocks.popleft()
                line.future, line.told = None, False
                yield found

    def _lines(self, blocks: Sequence[Block]) -> list[_Line]:
        """Return the blocks, those that have to stay on one host in one line."""
        if self.mix_machines:
            return [_Line(deque([block])) for block in blocks]
        suites = dict.fromkeys(block.suite for block in blocks)
        return [_Line(deque(b for b in blocks if b.suite == suite)) for suite in suites]

    def _give_out(self, lines: Sequence[_Line], scale: Scale) -> Iterator[Block]:
        """Give the first block of every line to a host that has no other."""
        for line in lines:
            taken = {other.host for other in lines if other is not line}
            at = None if line.future else self._free(line.host, taken)
            if at:
                if not line.told:
                    yield line.blocks[0]
                line.told, line.host, line.address = True, at.host, at.address
                line.future = self._submit(line.blocks[0], scale, workers=[at.address])

    def _free(self, host: str, taken: set[str]) -> Place | None:
        """Return a worker of this host; if it is "", of one that is not taken."""
        for address in self._here():
            one = self._places[address]
            allowed = self.mix_machines or one.machine == self._machine
            if allowed and (one.host == host if host else one.host not in taken):
                return one
        return None

    def _leave_lost_workers(self, lines: Sequence[_Line]) -> None:
        """Take back what a lost worker had, and bind its line to no host that is gone."""
        here = self._here()
        hosts = {self._places[address].host for address in here}
        for line in lines:
            if line.future and line.address not in here:
                line.future.cancel()
                line.future = None
            if line.host not in hosts:
                line.host = ""

    def _submit(self, block: Block, scale: Scale, **where: Any) -> Any:
        known = block.suite, pickle.dumps(scale), block_key(block)
        task = Task(*known, block.times, stamp(), self._topic)
        future = self._client.submit(perform, task, key=f"plumbob-{uuid.uuid4().hex}", **where)
        future.add_done_callback(self._done.put)
        return future

    def _heard(self, event: tuple[Any, Sequence[str]]) -> None:
        self._done.put(Progress(*event[1]))

    def _next(self) -> Any:
        """Return a future that is done, None if there is none for a while; pass on progress."""
        with contextlib.suppress(queue.Empty):
            found = self._done.get(timeout=_LOOK)
            if not isinstance(found, Progress):
                return found
            announce(*found)
        return None

    def _outcome(self, block: Block, future: Any) -> Step | None:
        """Return what came of a block, None if its worker was lost with it."""
        from distributed import KilledWorker

        try:
            reply: Reply = future.result(timeout=ANSWER)
        except TimeoutError:
            self._done.put(future)
            return None
        except KilledWorker:
            reply = Reply(failed="every worker that tried it was lost")
        except asyncio.CancelledError:
            raise ValueError(self._says("the scheduler is gone")) from None
        except Exception as error:
            raise ValueError(self._says(f"{type(error).__name__}: {error}")) from None
        if reply.refused:
            raise ValueError(self._says(reply.refused))
        if reply.failed:
            return replace(record_of(block, failure(reply.failed), 0.0), stamp=self.stamp())
        return decode(reply.line)

    def _wait_for_workers(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=self._patience)
        except TimeoutError:
            why = f"expected a worker, got none within {self._patience:g} s"
            raise ValueError(self._says(why)) from None
        while not self._here():
            pass

    def _here(self) -> list[str]:
        """Return the addresses of the workers that are there, in order, and get to know new ones.

        Raises:
            ValueError: if one has other versions or sources.
        """
        try:
            addresses = sorted(self._client.nthreads())
            if new := [address for address in addresses if address not in self._places]:
                replies = self._client.run(place, workers=new, on_error="return")
                self._places |= {at: self._known(at, reply) for at, reply in replies.items()}
        except (OSError, RuntimeError, TimeoutError):
            raise ValueError(self._says("the scheduler is gone")) from None
        return [address for address in addresses if address in self._places]

    def _known(self, address: str, reply: Any) -> Place:
        if isinstance(reply, ImportError):
            raise ValueError(f"worker {address}: expected Plumbob, got {reply}")
        if isinstance(reply, Exception):
            raise reply
        if why := unlike(stamp(), reply["stamp"]):
            raise ValueError(f"worker {address}: expected what is installed here, got {why}")
        return Place(address, **reply)

    def _says(self, what: str) -> str:
        return f"{DASK}{self.address}: {what}"


def _connected(address: str, patience: float) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(_NO_EXTRA) from None
    for name in ("distributed", "distributed.client", "asyncio"):  # what they say is said by us
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        if asyncio.run(asyncio.wait_for(_identity(address), patience)).get("type") != "Scheduler":
            raise ValueError
        return Client(address, timeout=patience, set_as_default=False, name="plumbob")
    except (OSError, TimeoutError):
        why = f"got no answer within {patience:g} s"
    except Exception:  # whatever reading the answer of another program raises
        why = "got an answer of something else"
    raise ValueError(f"{DASK}{address}: expected a Dask scheduler, {why}")


async def _identity(address: str) -> Mapping[str, Any]:
    """Return what a Dask process says of itself; a Client would wait for it without a limit."""
    from distributed.core import rpc
    from distributed.security import Security

    async with rpc(address, connection_args=Security().get_connection_args("client")) as process:
        identity: Mapping[str, Any] = await process.identity()
        return identity


def _machine(of: Mapping[str, Any]) -> str:
    """Return the machine of a stamp, as what can be compared and counted."""
    return json.dumps(dict(of.get("machine", {})), sort_keys=True)


def _in_words(machine: str) -> str:
    return ", ".join(str(value) for value in json.loads(machine).values())
