"""The common style of all figures, which are SVG text and compute nothing.

Colours are tuned for a white page and named in `COLOURS`, so that a page with a dark side can put
its own in their place. Series differ in line style or marker as well as in colour.
"""

import contextlib
import io
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..peers import registry
from .text import shortened

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
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "plumbob",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 9,
    "axes.edgecolor": COLOURS["faint"],
    "axes.labelcolor": COLOURS["ink"],
    "axes.titlecolor": COLOURS["ink"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.linewidth": 0.7,
    "grid.color": COLOURS["rule"],
    "grid.linewidth": 0.6,
    "text.color": COLOURS["ink"],
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "mathtext.default": "regular",
}
for _axis in ("xtick", "ytick"):
    STYLE |= {f"{_axis}.color": COLOURS["faint"], f"{_axis}.labelcolor": COLOURS["ink"]}
    STYLE[f"{_axis}.labelsize"] = 8
WIDTH = 7.4
# Letters of a name in a figure.
LONGEST = 60


class Drawing(NamedTuple):
    """A figure or picture: the stem of its file, what it shows, and the SVG."""

    name: str
    title: str
    shows: str
    svg: str


def written(name: str) -> str:
    """Return a name as matplotlib writes it letter by letter: no formula, no label to be hidden."""
    short = shortened(name, LONGEST).replace("$", r"\$")
    return f" {short}" if short.startswith("_") else short or "–"


@contextlib.contextmanager
def canvas(
    height: float, columns: int, rows: int = 1, *, sharex: bool = False, sharey: bool = False
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure [inch high] in the common style and its axes, row by row."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
        yield figure, list(axes.ravel())


def finished(figure: Figure, name: str, title: str, shows: str) -> Drawing:
    """Return the figure as a drawing, the same for the same figure."""
    text = io.StringIO()
    with warnings.catch_warnings():  # the page's fonts have all letters, and names may be many
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        warnings.filterwarnings("ignore", "constrained_layout not applied")
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Title": title})
    return Drawing(name, title, shows, text.getvalue())


def every_handle(axes: list[Axes]) -> tuple[list[Any], list[str]]:
    """Return a handle and its label for each solver that is in any panel."""
    found: dict[str, Any] = {}
    for ax in axes:
        found |= {
            name: handle for handle, name in zip(*ax.get_legend_handles_labels(), strict=True)
        }
    return list(found.values()), list(found)


def nth_style(i: int) -> dict[str, Any]:
    """Return a colour and a line for the i-th of many solvers; all pairs differ for a while."""
    colours = ("blue", "orange", "green", "purple", "brass", "ink")
    lines = ("-", "--", "-.", ":")
    return {"color": COLOURS[colours[i % len(colours)]], "linestyle": lines[i % len(lines)]}


def drawn_as(solver: str) -> dict[str, Any]:
    """Return colour, line and label of a solver that has a style of its own."""
    known = registry.find(solver)
    colour, line, _ = known.style
    return {"color": COLOURS[colour], "linestyle": line, "label": written(known.label)}


def legend_height(names: list[str], columns: int) -> float:
    """Return how much higher [inch] a figure is for a legend of more than two rows."""
    return 0.2 * max(0, -(-len(names) // columns) - 2)


def plain_powers(ax: Axes) -> None:
    """Write 1, 10, 1,000 in place of powers on a logarithmic axis, without minor ticks."""
    ax.xaxis.set_major_formatter(mpl.ticker.FuncFormatter(_plain))
    ax.minorticks_off()


def _plain(x: float, _: int) -> str:
    return f"{x:,.0f}" if x >= 1 else f"{x:g}"
