"""The colours of figures, and how names are written in them."""

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
# Letters of a name in a figure.
LONGEST = 60


def written(name: str) -> str:
    """Return a name as matplotlib writes it letter by letter: no formula, no label to be hidden."""
    short = shortened(name, LONGEST).replace("$", r"\$")
    return f" {short}" if short.startswith("_") else short or "–"
