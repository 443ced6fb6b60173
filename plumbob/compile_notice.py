"""A line on a terminal while a kernel is compiled, lest its first call seem to hang."""

import atexit
import sys
import threading
from contextlib import ExitStack

# Shorter compilations are not worth a line [s].
DELAY = 1.0

_installed = ExitStack()
atexit.register(_installed.close)  # while the modules that it needs are still there
_timers: dict[tuple[int, str], threading.Timer] = {}


def install() -> None:
    """Say on stderr, if that is a terminal, what has been compiling for a second; once a process.

    The compiled version is kept on disk, so that the line comes once for each kernel.
    """
    from plumbob.reference.backend.compilation import on_compile

    _installed.close()
    _installed.enter_context(on_compile(_heard))


def _heard(label: str, begins: bool) -> None:
    key = threading.get_ident(), label
    if not begins:
        _timers.pop(key).cancel()
    else:
        _timers[key] = threading.Timer(DELAY, _say, [f"compiling {label}, once"])
        _timers[key].daemon = True
        _timers[key].start()


def _say(line: str) -> None:
    if sys.stderr is not None and sys.stderr.isatty():
        sys.stderr.write(f"{line}\n")
        sys.stderr.flush()
