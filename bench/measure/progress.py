"""Progress reports: a long measurement announces its steps, a caller may listen."""

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import NamedTuple

# The state when a user's solver gives no answer for the first time; the message says why.
TROUBLE = "trouble"


class Progress(NamedTuple):
    """A step of a measurement; `state` and `message` if the state of a case changes."""

    subject: str
    state: str = ""
    message: str = ""


_listener: ContextVar[Callable[[Progress], None] | None] = ContextVar("listener", default=None)


@contextlib.contextmanager
def listening(listener: Callable[[Progress], None]) -> Iterator[None]:
    """Call `listener` with every announcement made inside the block."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def announce(subject: str, state: str = "", message: str = "") -> None:
    """Report a step to the listener, if any."""
    listener = _listener.get()
    if listener is not None:
        listener(Progress(subject, state, message))
