"""Text from files that nobody has vouched for."""

import os
import warnings
from pathlib import Path

from ..arguments import shown

LARGEST = 256 * 2**20  # bytes


class FormatWarning(UserWarning):
    """A file departs from its format in what can be read all the same; the message says how."""


def warn(problem: str) -> None:
    """Warn of what a file says, by a sentence that names the file and the line."""
    warnings.warn(problem, FormatWarning, stacklevel=3)


def read_text(path: str | os.PathLike[str], *, largest: int = LARGEST) -> str:
    r"""Return the text of a file, its lines ended by \n alone, without a byte order mark.

    No more than `largest` bytes and one are ever read, whatever size the file claims.

    Raises:
        ValueError: if there is no such file, it is no regular file or cannot be read, it is larger
            than `largest` bytes, or it holds a NUL or what is not UTF-8.
    """
    data = _bytes(path, largest)
    if b"\0" in data:
        raise ValueError(f"{path}: expected text, got a NUL byte at offset {data.index(0)}")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{path}: expected UTF-8, got byte {data[error.start]:#04x} at offset {error.start}"
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def checked_path(path: str | os.PathLike[str]) -> str:
    """Return the path of a file as a string.

    Raises:
        ValueError: if it is none, is empty or holds a NUL.
    """
    given = os.fspath(path) if isinstance(path, str | os.PathLike) else None
    if not isinstance(given, str) or not given or "\0" in given:
        raise ValueError(f"path: expected a path, got {shown(path)}")
    return given


def _bytes(path: str | os.PathLike[str], largest: int) -> bytes:
    path = checked_path(path)
    try:
        if not Path(path).exists():
            raise ValueError(f"{path}: there is no such file")
        if not Path(path).is_file():  # a pipe or a device might never end
            raise ValueError(f"{path}: expected a regular file")
        with open(path, "rb") as file:
            data = file.read(largest + 1)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    if len(data) > largest:
        raise ValueError(f"{path}: expected at most {largest} bytes, got more")
    return data
