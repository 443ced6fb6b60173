"""Paths from elsewhere: a regular file of a bearable size, a folder, or nothing yet."""

import stat
from pathlib import Path

# Reading a file takes several times its size of memory; the whole bench writes a hundredth of this.
LARGEST = 1 << 30


def check_regular(path: Path) -> None:
    """Check that a path is a regular file, or does not exist.

    Raises:
        ValueError: for a folder, a pipe or a device, or a file larger than `LARGEST`.
    """
    try:
        mode, size = path.stat().st_mode, path.stat().st_size
    except (FileNotFoundError, NotADirectoryError):
        return
    if not stat.S_ISREG(mode):
        raise ValueError(f"{path}: expected a file, got a {_kind_of_file(mode)}")
    if size > LARGEST:
        raise ValueError(f"{path}: expected at most {LARGEST} bytes, got {size}")


def check_folder(path: Path) -> None:
    """Check that a path is a folder, or does not exist.

    Raises:
        ValueError: for a file, a pipe or a device.
    """
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path}: expected a folder, got a {_kind_of_file(path.stat().st_mode)}")


def _kind_of_file(mode: int) -> str:
    kinds = {stat.S_IFDIR: "folder", stat.S_IFIFO: "pipe", stat.S_IFREG: "file"}
    kinds |= {stat.S_IFCHR: "device", stat.S_IFBLK: "device", stat.S_IFSOCK: "socket"}
    return kinds.get(stat.S_IFMT(mode), "special file")
