"""Notify listeners of the compilation of kernels, for which the first call takes seconds.

This library prints nothing; the command line and the public package subscribe.
"""

import contextlib
import functools
import gc
from collections.abc import Callable, Iterator
from typing import Any

# Called with the label of a kernel, and True as its compilation begins, False as it ends.
Listener = Callable[[str, bool], None]

_listeners: list[Listener] = []
_collecting = True  # before the compilation; numba compiles one kernel at a time


@contextlib.contextmanager
def on_compile(listener: Listener) -> Iterator[None]:
    """Call a listener, inside the block, as the compilation of a kernel begins and ends.

        with on_compile(lambda label, begins: ...):

    The listener is called in the thread that compiles, and not for kernels from the disk cache.
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def numba_settings() -> Any:
    """Return numba's settings, which come from environment variables.

    Raise a ValueError if numba refuses its number of threads.
    """
    try:
        import numba
    except ValueError as error:
        raise ValueError(
            f"NUMBA_NUM_THREADS: expected a number that numba takes: {error}"
        ) from None
    return numba.config


@functools.cache
def watch_numba() -> None:
    """Let numba report each compilation, once a process."""
    from numba.core import event

    class Watch(event.Listener):
        def on_start(self, event: Any) -> None:
            _notify(event.data["dispatcher"], begins=True)

        def on_end(self, event: Any) -> None:
            _notify(event.data["dispatcher"], begins=False)

    event.register("numba:compile", Watch())


def _notify(dispatcher: Any, *, begins: bool) -> None:
    """Call the listeners; pause the garbage collector, which takes an eighth of the time."""
    global _collecting
    if not hasattr(dispatcher, "label"):
        return
    if begins:
        _collecting = gc.isenabled()
        gc.disable()
    elif _collecting:
        gc.enable()
    for listener in tuple(_listeners):
        listener(dispatcher.label, begins)
