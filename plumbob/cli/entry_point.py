"""The start of the command line: handle Ctrl-C and closed streams, then import the rest."""

import contextlib
import os
import signal
import sys
from collections.abc import Sequence
from typing import Any

INTERRUPTED = 130  # as shells report a program ended by SIGINT, 128 + 2


def main() -> None:
    """Import the command line, run it and leave with its exit code."""
    leave_at_interrupt()
    open_closed_streams()
    from .main import main as run

    run()


def interruption(arguments: Sequence[str]) -> str:
    """Return the message after Ctrl-C; a bench and the main job keep finished measurements."""
    is_main_job = not arguments or arguments[0] in ("-o", "--output", "--fresh")
    is_bench = is_main_job or "bench" in arguments
    return "plumbob: interrupted" + "; finished measurements are kept" * is_bench


def open_closed_streams() -> None:
    """Open the null device in place of closed standard streams.

    The next files would otherwise take their numbers, and receive all output.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def leave_at_interrupt() -> None:
    """Let Ctrl-C end the process at once."""
    handle_interrupt(_leave)


def handle_interrupt(handler: Any) -> None:
    """Call a handler at Ctrl-C, unless ignored, as in the background of a script."""
    if signal.getsignal(signal.SIGINT) != signal.SIG_IGN:
        signal.signal(signal.SIGINT, handler)


def _leave(*_: object) -> None:
    with contextlib.suppress(OSError):
        os.write(2, f"{interruption(sys.argv[1:])}\n".encode())
    os._exit(INTERRUPTED)
