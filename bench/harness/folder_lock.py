"""Let one process at a time write the records of a folder."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from .record import check_regular

LOCK_NAME = "records.lock"


@contextlib.contextmanager
def locked(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Hold a folder for as long as the block lasts; a process that was killed holds nothing.

    On a file system without locks nothing is held. The file stays: to remove it would let two
    processes lock two files of one name.

    Raises:
        ValueError: naming folder and process, if another holds it.
    """
    path = Path(folder, LOCK_NAME)
    path.parent.mkdir(parents=True, exist_ok=True)
    check_regular(path)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        _lock(descriptor, path)
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int, path: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ValueError(
            f"{path.parent}: expected a folder that nobody writes to, got that of "
            f"{_holder(path)}; wait for it to end, or name another folder"
        ) from None
    except OSError:
        return
    with contextlib.suppress(OSError):  # the number is for the reader; the disk may be full
        os.ftruncate(descriptor, 0)
        os.write(descriptor, str(os.getpid()).encode())


def _holder(path: Path) -> str:
    number = path.read_text(encoding="utf-8")
    return f"process {number}" if number.isdigit() else "another process"
