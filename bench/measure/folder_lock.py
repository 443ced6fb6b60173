"""Let a single process write the records of a folder."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import filelock

from plumbob.process.paths import check_regular

LOCK_NAME = "records.lock"


@contextlib.contextmanager
def locked(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Hold the lock of a folder inside the block; the lock of a killed process is free.

    Raises:
        ValueError: naming folder and process, if another process holds the lock, or if the file
            of the lock is a link, which could lead to any file of the user's.
    """
    path = Path(folder, LOCK_NAME)
    path.parent.mkdir(parents=True, exist_ok=True)
    check_lock_file(path)
    lock = filelock.FileLock(path, timeout=0)
    try:
        lock.acquire()
    except filelock.Timeout:
        raise ValueError(
            f"{folder}: expected a folder that nobody writes to, got that of {_holder(path)}; wait "
            "for it to end, or name another folder"
        ) from None
    try:
        with contextlib.suppress(OSError):  # the number is for the reader; the disk may be full
            path.write_text(str(os.getpid()), encoding="utf-8")
        yield
    finally:
        lock.release()


def check_lock_file(path: Path) -> None:
    """Refuse a link or anything but a file as the file of a lock.

    Raises:
        ValueError: if the path is a link or no regular file; a missing file is accepted.
    """
    if path.is_symlink():
        raise ValueError(f"{path}: expected a file, got a link")
    check_regular(path)


def _holder(path: Path) -> str:
    """Return the owner process of a lock, as far as its file says so."""
    number = ""
    with contextlib.suppress(OSError):  # Windows lets nobody else read the file
        number = path.read_text(encoding="utf-8")
    return f"process {number}" if number.isdigit() else "another process"
