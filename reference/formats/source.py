"""Text from untrusted files, with limits on its size and encoding."""

import codecs
import os
import re
import warnings
from pathlib import Path

from ..arguments import shown

LARGEST = 256 * 2**20  # bytes
UTF_8, UTF_16 = "utf-8-sig", "utf-16"
# The declaration of an encoding of a byte per character in an XML file; others count as UTF-8.
DECLARATION = re.compile(
    rb"""\s*<\?xml\s[^<>]{0,200}?\sencoding\s*=\s*["']"""
    rb"""(iso-8859-(?:1[013456]?|[2-9])|latin-?1|windows-125[0-8])["']""",
    re.IGNORECASE,
)


class FormatWarning(UserWarning):
    """A file violates its format but can be read; the message says how."""


def warn(problem: str) -> None:
    """Emit a `FormatWarning`; the sentence names the file and the line."""
    warnings.warn(problem, FormatWarning, stacklevel=3)


def read_text(path: str | os.PathLike[str], *, largest: int = LARGEST, is_xml: bool = False) -> str:
    r"""Return the text of a file with line ends \n and without a byte order mark.

    XML may be in UTF-16 or in its declared encoding (`xml_encoding`), other text is UTF-8.

    Raises:
        ValueError: as for `read_bytes`, or if the file contains a NUL byte or has another encoding.
    """
    content = read_bytes(path, largest=largest)
    encoding = xml_encoding(content) if is_xml else UTF_8
    if b"\0" in content and encoding != UTF_16:
        raise ValueError(f"{path}: expected text, got a NUL byte at offset {content.index(0)}")
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        expected = encoding.upper().removesuffix("-SIG")
        got = f"byte {content[error.start]:#04x} at offset {error.start}"
        raise ValueError(f"{path}: expected {expected}, got {got}") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def xml_encoding(content: bytes) -> str:
    """Return UTF-16 if a byte order mark says so, else the declared encoding of bytes, or UTF-8."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return UTF_16
    declaration = DECLARATION.match(content)
    return declaration[1].decode() if declaration else UTF_8


def checked_path(path: str | os.PathLike[str]) -> str:
    """Return the path of a file as a string; a ValueError if it is no path, empty or has a NUL."""
    text = os.fspath(path) if isinstance(path, str | os.PathLike) else None
    if not isinstance(text, str) or not text or "\0" in text:
        raise ValueError(f"path: expected a path, got {shown(path)}")
    return text


def read_bytes(path: str | os.PathLike[str], *, largest: int = LARGEST) -> bytes:
    """Return the content of a file; read at most `largest` + 1 bytes.

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
            is_larger = os.fstat(file.fileno()).st_size > largest
            content = b"" if is_larger else file.read(largest + 1)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    if is_larger or len(content) > largest:
        raise ValueError(f"{path}: expected at most {largest} bytes, got more")
    return content
