"""Let a single process write the records of a folder."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from plumbob.process.paths import check_regular

LOCK_NAME = "records.lock"


@contextlib.contextmanager
def locked(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Hold the lock of a folder inside the block; the lock of a killed process is free.

    A file system without locks allows everyone. The lock's file stays: without it two
    processes could lock two files of the same name.

    Raises:
        ValueError: naming folder and process, if another holds it.
    """
    path = Path(folder, LOCK_NAME)
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = open_lock(path, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            number = path.read_text(encoding="utf-8")
            raise ValueError(
                f"{folder}: expected a folder that nobody writes to, got that of "
                f"{f'process {number}' if number.isdigit() else 'another process'}; wait for it "
                "to end, or name another folder"
            ) from None
        except OSError:  # a file system without locks
            pass
        else:
            with contextlib.suppress(OSError):  # the number is for the reader; the disk may be full
                os.ftruncate(descriptor, 0)
                os.write(descriptor, str(os.getpid()).encode())
        yield
    finally:
        os.close(descriptor)


def open_lock(path: Path, mode: int) -> int:
    """Return the descriptor of a lock file, which is created with this mode if it is missing.

    Raises:
        ValueError: if it is a link, which could lead to any file of the user's, or no file.
    """
    if path.is_symlink():
        raise ValueError(f"{path}: expected a file, got a link")
    check_regular(path)
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, mode)
