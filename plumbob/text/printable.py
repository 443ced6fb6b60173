"""Names from elsewhere as text that no terminal, browser or parser reads as an instruction."""

import re
from collections.abc import Mapping
from typing import Any

# What GitHub and Azure obey on a line of a log: the first at its beginning, the second anywhere.
_COMMAND = re.compile(r"^ ?( *)(?=::)|(?<=#)(?=#\w*\[)")


def shortened(text: str, length: int) -> str:
    """Return a text of at most so many letters, its end cut off if necessary."""
    return text if len(text) <= length else f"{text[: length - 1]}…"


def visible(text: str) -> str:
    """Return a line in which unprintable characters are written as escapes, as in Python."""
    spaced = " ".join(text.split())
    if spaced.isprintable():
        return spaced
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in spaced
    )


def harmless(line: str) -> str:
    """Return a line of a screen in which no CI service finds a command, such as `::error`."""
    return _COMMAND.sub(r"\1\\", line)


def all_visible(value: Any) -> Any:
    """Return a value with every text in it, keys of mappings included, made visible."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, Mapping):
        return {all_visible(key): all_visible(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [all_visible(inner) for inner in value]
    return value


def one_line(text: str | bytes, length: int = 200) -> str:
    """Return a text of a solver on one line, without control characters, shortened."""
    words = text.decode(errors="replace") if isinstance(text, bytes) else text
    clean = "".join(letter if letter.isprintable() else " " for letter in words[: 4 * length])
    clean = " ".join(clean.split())
    return clean if len(clean) <= length else f"{clean[: length - 3]}..."
