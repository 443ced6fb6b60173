"""Text from untrusted files, with limits on its size and encoding."""

import os
import warnings
from pathlib import Path

from ..arguments import shown

LARGEST = 256 * 2**20  # bytes


class FormatWarning(UserWarning):
    """A file violates its format but can be read; the message says how."""


def warn(problem: str) -> None:
    """Emit a `FormatWarning`; the sentence names the file and the line."""
    warnings.warn(problem, FormatWarning, stacklevel=3)


def read_text(path: str | os.PathLike[str], *, largest: int = LARGEST) -> str:
    r"""Return the text of a file with line ends \n and without a byte order mark.

    Raises:
        ValueError: as for `read_bytes`, or if it contains a NUL byte or is not UTF-8.
    """
    content = read_bytes(path, largest=largest)
    if b"\0" in content:
        raise ValueError(f"{path}: expected text, got a NUL byte at offset {content.index(0)}")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{path}: expected UTF-8, got byte {content[error.start]:#04x} at offset {error.start}"
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def checked_path(path: str | os.PathLike[str]) -> str:
    """Return the path of a file as a string; a ValueError if it is none, empty or has a NUL."""
    text = os.fspath(path) if isinstance(path, str | os.PathLike) else None
    if not isinstance(text, str) or not text or "\0" in text:
        raise ValueError(f"path: expected a path, got {shown(path)}")
    return text


def read_bytes(path: str | os.PathLike[str], *, largest: int = LARGEST) -> bytes:
    """Return the content of a file; read at most `largest` + 1 bytes of it.

    Raise a ValueError if the file does not exist, is not regular, cannot be read, or is larger than
    `largest` bytes.
    """
    path = checked_path(path)
    try:
        if not Path(path).exists():
            raise ValueError(f"{path}: there is no such file")
        if not Path(path).is_file():  # a pipe or a device might never end
            raise ValueError(f"{path}: expected a regular file")
        with open(path, "rb") as file:
            content = file.read(largest + 1)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    if len(content) > largest:
        raise ValueError(f"{path}: expected at most {largest} bytes, got more")
    return content
