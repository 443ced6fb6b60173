"""Names from elsewhere as text that no terminal, browser or parser takes for an instruction."""

import functools
import re
from collections.abc import Mapping, Sequence
from typing import Any

# Where a word may be broken: after a dash and its like between letters, never in a number.
_BREAK = re.compile(r"(?<=[^\W\d_][/_.-])(?=[^\W\d_])")


def visible(text: str) -> str:
    """Return one line in which whatever does not print is written as an escape, as in Python."""
    spaced = " ".join(text.split())
    if spaced.isprintable():
        return spaced
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in spaced
    )


def all_visible(value: Any) -> Any:
    """Return a value with every text in it, keys of mappings included, made visible."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, Mapping):
        return {all_visible(key): all_visible(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [all_visible(inner) for inner in value]
    return value


def shortened(text: str, length: int) -> str:
    """Return the text, its end cut off if it is longer."""
    return text if len(text) <= length else f"{text[: length - 1]}…"


@functools.lru_cache(maxsize=10_000)
def chunks(text: str) -> Sequence[str]:
    """Return a text in the parts between which a line may end: after spaces, dashes, slashes."""
    return [part for token in text.split() for part in _BREAK.split(token)]
