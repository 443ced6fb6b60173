"""Batches on all cores: slices of a batch, each by a kernel in a thread of its own.

Compiled kernels let go of the interpreter, so threads are enough; they are started once and kept.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar, copy_context
from itertools import pairwise
from typing import Any

from .. import arguments

# More slices than cores, so that a core whose slices were easy takes some of the others'.
SLICES_PER_CORE = 4
# How long to wait for a slice at a time [s].
TURN = 0.1

# By their size, each with its threads.
_pools: dict[int, tuple[ThreadPoolExecutor, list[threading.Thread]]] = {}
_cores: ContextVar[int | None] = ContextVar("cores", default=None)


@contextlib.contextmanager
def cores(count: int | None) -> Iterator[None]:
    """Spread batches over so many cores; None, the default, is all that the process may use.

    Results are the same bits whatever the count.

    Raises:
        ValueError: if the count is not a positive integer.
    """
    token = _cores.set(None if count is None else arguments.integer("count", count, least=1))
    try:
        yield
    finally:
        _cores.reset(token)


def in_slices(
    kernel: Callable[..., Any],
    count: int,
    given: Callable[[slice], tuple[Any, ...]],
    *,
    least: int,
) -> list[Any]:
    """Call a kernel on slices of a batch, side by side; return what it returns, slice by slice.

    A batch of less than two slices of `least` is one call in the caller's thread. The first error
    is raised, and slices not yet begun are dropped, as they are at an interrupt. A slice is not cut
    again by what it calls.

        in_slices(kernel, len(x), lambda part: (model, x[part], result[part]), least=100)

    Args:
        kernel: what fills its part of the results, most often a TwoSpeeds.
        count: the length of the batch.
        given: returns the kernel's arguments for a slice.
        least: items in a slice; fewer would not be worth a thread.
    """
    threads = (_cores.get() or _all_cores()) if count >= 2 * least else 1
    if threads == 1:
        return [kernel(*given(slice(0, count)))]
    slices = min(count // least, SLICES_PER_CORE * threads)
    pool, parts = _pool(threads), []
    try:
        for begin, end in pairwise(count * i // slices for i in range(slices + 1)):
            as_here = copy_context()  # each thread is to see the speed in force
            as_here.run(_cores.set, 1)
            parts.append(pool.submit(as_here.run, kernel, *given(slice(begin, end))))
        return [_result(part) for part in parts]
    finally:
        for part in parts:
            part.cancel()


def _result(part: Future) -> Any:
    """Wait in turns: an interrupt that comes just before a turn is seen after it."""
    while not part.done():
        with contextlib.suppress(TimeoutError):
            part.result(TURN)
    return part.result()


def _all_cores() -> int:
    """Return how many cores the process may use, as numba counts them."""
    import numba

    config: Any = numba.config
    return config.NUMBA_NUM_THREADS


def _pool(size: int) -> ThreadPoolExecutor:
    """Return a pool that is kept; a process forked from ours has none of its threads."""
    pool, threads = _pools.get(size, (None, []))
    if pool is None or not all(thread.is_alive() for thread in threads):
        threads = []
        pool = ThreadPoolExecutor(
            size, "plumbob", lambda: threads.append(threading.current_thread())
        )
        _pools[size] = pool, threads
    return pool
