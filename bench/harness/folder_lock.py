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
    descriptor = open_lock(path, 0o644)
    try:
        _lock(descriptor, path)
        yield
    finally:
        os.close(descriptor)


def open_lock(path: Path, mode: int) -> int:
    """Return the descriptor of a lock file, which is made with this mode where there is none.

    A link is not followed: it could lead to any file of the user's, to be made or emptied.

    Raises:
        ValueError: if there is a link, or anything else that is no file.
    """
    if path.is_symlink():
        raise ValueError(f"{path}: expected a file, got a link")
    check_regular(path)
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, mode)


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
