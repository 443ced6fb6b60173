"""Names from elsewhere as text that no terminal, browser or parser reads as an instruction."""

import functools
import re
from collections.abc import Sequence

from plumbob.verify.sentence import all_visible, harmless, visible

__all__ = ["all_visible", "chunks", "harmless", "shortened", "visible"]

# Where a word may be broken: after a dash or the like between letters, never in a number.
_BREAK = re.compile(r"(?<=[^\W\d_][/_.-])(?=[^\W\d_])")


def shortened(text: str, length: int) -> str:
    """Return a text of at most so many letters, its end cut off if necessary."""
    return text if len(text) <= length else f"{text[: length - 1]}…"


@functools.lru_cache(maxsize=10_000)
def chunks(text: str) -> Sequence[str]:
    """Return the parts of a text between which a line may end: after spaces, dashes, slashes."""
    return [part for token in text.split() for part in _BREAK.split(token)]
