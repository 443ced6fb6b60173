"""The common style of figures (`style.toml`), and names in figures."""

import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from plumbob.text.printable import shortened

_STYLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
COLOURS: dict[str, str] = _STYLE["colours"]
# Parameters of matplotlib for all figures.
PARAMETERS: dict[Any, Any] = {
    name: COLOURS.get(str(value), value) for name, value in _STYLE["parameters"].items()
}


class Style(NamedTuple):
    """How a solver is drawn: a colour of `COLOURS`, a line and a marker of matplotlib's."""

    colour: str
    line: Any
    marker: str


# The most letters of a name.
LONGEST = 60


def plain_label(name: str) -> str:
    """Return a name as plain text for matplotlib: neither a formula nor a hidden label."""
    short = shortened(name, LONGEST).replace("$", r"\$")
    return f" {short}" if short.startswith("_") else short or "–"
