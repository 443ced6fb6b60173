"""Colours of figures, and names in them."""

from ..text import shortened

COLOURS = {
    "ink": "#22272e",
    "faint": "#68717d",
    "rule": "#d5d9df",
    "blue": "#0b62a8",
    "orange": "#c4500c",
    "green": "#0b7a5b",
    "purple": "#8a4a9f",
    "brass": "#96690f",
}
# The most letters of a name.
LONGEST = 60


def plain_label(name: str) -> str:
    """Return a name that matplotlib reads as plain text: neither a formula nor a hidden label."""
    short = shortened(name, LONGEST).replace("$", r"\$")
    return f" {short}" if short.startswith("_") else short or "–"
