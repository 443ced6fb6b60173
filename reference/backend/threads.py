"""Spread a batch over all cores: each slice is computed by a kernel in a thread of a pool.

Compiled kernels release the interpreter's lock, so threads suffice; threads are kept for reuse.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar, copy_context
from itertools import pairwise
from typing import Any

from .. import arguments
from .compilation import numba_settings

# More slices than cores: a core that finishes early takes another slice.
SLICES_PER_CORE = 4
# How often a waiting thread looks for an interrupt [s].
POLL = 0.1

# Pools by their size, each with its threads.
_pools: dict[int, tuple[ThreadPoolExecutor, list[threading.Thread]]] = {}
_num_threads: ContextVar[int | None] = ContextVar("num_threads", default=None)


@contextlib.contextmanager
def set_num_threads(count: int | None) -> Iterator[None]:
    """Set the number of threads for batches inside the block; None, the default: all cores.

        with set_num_threads(1):

    Results are the same bits whatever the count.

    Raises:
        ValueError: if the count is not a positive integer.
    """
    token = _num_threads.set(
        None if count is None else arguments.integer("count", count, minimum=1)
    )
    try:
        yield
    finally:
        _num_threads.reset(token)


def in_slices(
    kernel: Callable[..., Any],
    count: int,
    arguments_of: Callable[[slice], tuple[Any, ...]],
    *,
    minimum: int,
) -> list[Any]:
    """Call a kernel on slices of a batch in parallel; return its results, slice by slice.

    A batch of less than two slices of `minimum` is a single call in the caller's thread. At an
    error or an interrupt, slices not yet begun are dropped. Calls of this function within a slice
    do not divide the slice again.

        in_slices(kernel, len(x), lambda part: (model, x[part], result[part]), minimum=100)

    `count` is the length of the batch and `minimum` the smallest slice worth a thread.
    """
    threads = (_num_threads.get() or _all_cores()) if count >= 2 * minimum else 1
    if threads == 1:
        return [kernel(*arguments_of(slice(0, count)))]
    slices = min(count // minimum, SLICES_PER_CORE * threads)
    pool, parts = _pool(threads), []
    try:
        for begin, end in pairwise(count * number // slices for number in range(slices + 1)):
            context = copy_context()  # so that each thread sees the backend in force
            context.run(_num_threads.set, 1)
            parts.append(pool.submit(context.run, kernel, *arguments_of(slice(begin, end))))
        return [_result(part) for part in parts]
    finally:
        for part in parts:
            part.cancel()


class ArraysOfThread(threading.local):
    """An object with arrays of its own in each thread that shares the object, and in a copy."""

    _problem: tuple[Any, ...]  # the arguments of its constructor

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._problem


def _result(part: Future[Any]) -> Any:
    """Wait for a slice, and see an interrupt within `POLL` seconds."""
    while not part.done():
        with contextlib.suppress(TimeoutError):
            part.result(POLL)
    return part.result()


def _all_cores() -> int:
    """Return the number of cores for the process, counted as in numba."""
    return numba_settings().NUMBA_NUM_THREADS


def _pool(size: int) -> ThreadPoolExecutor:
    """Return a pool of threads, a new pool after a fork, which leaves no thread alive."""
    pool, threads = _pools.get(size, (None, []))
    if pool is None or not all(thread.is_alive() for thread in threads):
        threads = []
        pool = ThreadPoolExecutor(
            size, "plumbob", lambda: threads.append(threading.current_thread())
        )
        _pools[size] = pool, threads
    return pool
