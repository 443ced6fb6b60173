"""Where the command line begins, ready for Ctrl-C and closed streams before it imports the rest."""

import contextlib
import os
import signal
import sys
from typing import Any

INTERRUPTED = 130
INTERRUPTION = "plumbob: interrupted; a bench keeps what it has finished"


def main() -> None:
    """Import the command line, run it and leave with its exit code."""
    leave_at_interrupt()
    open_closed_streams()
    from .cli import main as run

    run()


def open_closed_streams() -> None:
    """Open the null device in place of standard streams that are closed.

    Their numbers would otherwise go to the next files, and all that is printed into these.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def leave_at_interrupt() -> None:
    """Let Ctrl-C end the process at once, where there is nothing to clean up."""
    handle_interrupt(_leave)


def handle_interrupt(handler: Any) -> None:
    """Call a handler at Ctrl-C, unless it is ignored, as in a script's background."""
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        signal.signal(signal.SIGINT, handler)


def _leave(*_: object) -> None:
    with contextlib.suppress(OSError):
        os.write(2, f"{INTERRUPTION}\n".encode())
    os._exit(INTERRUPTED)
