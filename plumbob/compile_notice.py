"""Print a line on a terminal while a kernel is compiled, which may take seconds."""

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
    """Print on stderr, if that is a terminal, the kernels that have compiled for a second.

    Compiled kernels are stored on disk, so that the line comes once for each.
    """
    from plumbob.reference.backend.compilation import on_compile

    _installed.close()
    _installed.enter_context(on_compile(_on_compile))


def _on_compile(label: str, begins: bool) -> None:
    key = threading.get_ident(), label
    if not begins:
        _timers.pop(key).cancel()
    else:
        _timers[key] = threading.Timer(DELAY, _print, [f"compiling {label}, once"])
        _timers[key].daemon = True
        _timers[key].start()


def _print(line: str) -> None:
    if sys.stderr is not None and sys.stderr.isatty():
        sys.stderr.write(f"{line}\n")
        sys.stderr.flush()
