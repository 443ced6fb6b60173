"""What a long measurement is doing just now, for whoever shows it."""

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import NamedTuple


class News(NamedTuple):
    """What is being done, and where that changes a case's state, the state and why."""

    what: str
    state: str = ""
    message: str = ""


_listener: ContextVar[Callable[[News], None] | None] = ContextVar("listener", default=None)


@contextlib.contextmanager
def heard_by(listener: Callable[[News], None]) -> Iterator[None]:
    """Let somebody hear what is told inside the block."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def tell(what: str, state: str = "", message: str = "") -> None:
    """Say what is being done now."""
    listener = _listener.get()
    if listener is not None:
        listener(News(what, state, message))
