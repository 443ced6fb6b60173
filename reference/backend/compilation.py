"""Who is to know that a kernel is being compiled: the first call of a kernel takes seconds.

This library prints nothing; a command line or a front door subscribes and says what it likes.
"""

import contextlib
import functools
import gc
from collections.abc import Callable, Iterator
from typing import Any

# Called with what is compiled, in the user's words, and True as that begins, False as it ends.
Listener = Callable[[str, bool], None]

_listeners: list[Listener] = []
_collecting = True


@contextlib.contextmanager
def on_compile(listener: Listener) -> Iterator[None]:
    """Call a listener, inside the block, as the compilation of a kernel begins and ends.

        with on_compile(lambda label, begins: ...):

    The listener is called in the thread that compiles. What is read from the cache on disk is not
    compiled.
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def numba_settings() -> Any:
    """Return numba's settings, which come from environment variables.

    Raises:
        ValueError: if numba refuses its number of threads.
    """
    try:
        import numba
    except ValueError as error:
        raise ValueError(f"NUMBA_NUM_THREADS: expected what numba takes: {error}") from None
    return numba.config


@functools.cache
def watch_numba() -> None:
    """Let numba report each compilation, once a process."""
    from numba.core import event

    class Watch(event.Listener):
        def on_start(self, event: Any) -> None:
            if hasattr(event.data["dispatcher"], "label"):
                _begin(event.data["dispatcher"].label)

        def on_end(self, event: Any) -> None:
            if hasattr(event.data["dispatcher"], "label"):
                _end(event.data["dispatcher"].label)

    event.register("numba:compile", Watch())


def _begin(label: str) -> None:
    """Tell the listeners, and let the garbage collector rest.

    It would look again and again at all that the compiler makes, an eighth of the time. Numba
    compiles one kernel at a time.
    """
    global _collecting
    _collecting = gc.isenabled()
    gc.disable()
    for listener in tuple(_listeners):
        listener(label, True)


def _end(label: str) -> None:
    if _collecting:
        gc.enable()
    for listener in tuple(_listeners):
        listener(label, False)
