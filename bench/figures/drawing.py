"""The common style of all figures, and how a chart is drawn; nothing here computes.

Colours are tuned for a white page and named in `style.COLOURS`, so that a page with a dark side
can put its own in their place. Solvers differ in line and marker as well as in colour.
"""

import contextlib
import io
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import escape
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D

from ..tables.results import label
from ..text import shortened
from .chart import GREY, LINE, SPAN, Axis, Chart, Look, Panel, Series, looks
from .style import COLOURS, written

# On the page no figure is narrower than 38 rem [inch]; letters there are never below 7 points.
WIDTH = 7.0
SMALLEST = 8.0
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "plumbob",
    "pdf.fonttype": 42,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 8.5,
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
    "legend.handlelength": 3.2,
    "lines.linewidth": 1.6,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "mathtext.default": "regular",
}
for _axis in ("xtick", "ytick"):
    STYLE |= {f"{_axis}.color": COLOURS["faint"], f"{_axis}.labelcolor": COLOURS["ink"]}
    STYLE[f"{_axis}.labelsize"] = SMALLEST
# Heights [inch] of a panel, of a row of marks, of a line of the legend.
PANEL, ROW, LEGEND = 2.05, 0.3, 0.19
# Letters of bold type to an inch, of the legend's, and of the name of a row at most.
_BOLD, _PLAIN, _ROW = 11.0, 13.0, 34
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Lines of the smallest letters beside a panel; steps between even ticks, most first.
_LINES, _STEPS = 14.0, range(6, 1, -1)
# Marks along a line.
_MARKS = 5


@contextlib.contextmanager
def styled() -> Iterator[None]:
    """Draw in the common style, without a word on letters that a font does not have."""
    with mpl.rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        warnings.filterwarnings("ignore", "constrained_layout not applied")
        yield


def canvas(
    height: float, columns: int, rows: int = 1, *, sharex: bool = False, sharey: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a figure [inch high] and its axes, row by row; within `styled`."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, list(axes.ravel())


def svg_of(figure: Figure, title: str, mark: str = "") -> str:
    """Return a figure as SVG, the same for the same figure, with a mark at its end."""
    text = io.StringIO()
    about = {"Date": None, "Creator": None, "Title": title}
    figure.savefig(text, format="svg", metadata=about)
    named = text.getvalue()
    for i, name in enumerate(getattr(figure, "named", ())):
        found = f'<g class="series"><title>{escape(label(name))}</title>'
        named = named.replace(f'<g id="series-{i}">', found).replace(f'<g id="series-{i}"/>', "")
    return f"{named}<!-- {mark} -->\n" if mark else named


def pdf_of(figure: Figure, title: str, mark: str = "") -> bytes:
    """Return a figure as PDF with its fonts and its text, the same for the same figure."""
    content = io.BytesIO()
    about = {"CreationDate": None, "Creator": None, "Producer": None, "Keywords": mark or None}
    figure.set_layout_engine("none")
    figure.savefig(content, format="pdf", metadata={**about, "Title": title})
    return content.getvalue()


def draw_chart(chart: Chart) -> Figure:
    """Return a chart drawn: panels, and a legend below them."""
    columns = max(1, min(chart.columns, len(chart.panels)))
    lines = -(-len(chart.panels) // columns)
    look = looks(chart.labelled)
    entries = _entries(chart, look)
    width = max((len(name) for _, name in entries), default=0) / _PLAIN + 0.6
    beside = max(1, int(WIDTH / width))
    tall = ROW * len(chart.rows) + 0.7 if chart.rows else PANEL
    height = tall * lines + 0.25 + LEGEND * -(-len(entries) // beside)
    figure, axes = canvas(height, columns, lines, sharex=not chart.rows, sharey=True)
    drawer = _Drawer(chart, look)
    for i, (ax, panel) in enumerate(zip(axes, chart.panels, strict=False)):
        drawer.draw(ax, panel)
        ax.set_title(_wrapped(panel.title, WIDTH / columns))
        if i + columns >= len(chart.panels):
            ax.set_xlabel(_wrapped(chart.x.label, WIDTH / columns, _PLAIN))
            ax.tick_params(labelbottom=True)
        if i % columns == 0 and (words := panel.label or chart.y.label):
            ax.set_ylabel(written(words))
    for ax in axes[: len(chart.panels)]:
        drawer.scale(ax)
    for ax in axes[len(chart.panels) :]:
        ax.remove()
    if entries:
        figure.legend(
            *map(list, zip(*entries, strict=True)),
            loc="outside lower left",
            ncols=beside,
            handler_map={tuple: HandlerTuple(ndivide=None)},
        )
    figure.named = chart.solvers  # type: ignore[attr-defined]
    return figure


def _wrapped(title: str, width: float, letters: float = _BOLD) -> str:
    """Return a title on two lines if it is longer than a panel is wide [inch]."""
    return _lines(title, max(12, int(width * letters)))


def _lines(text: str, length: int) -> str:
    """Return a text on two lines of so many letters at most, the end cut off if it is longer."""
    lines = textwrap.wrap(text, length)
    rest = [shortened(" ".join(lines[1:]), length)] if lines[1:] else []
    return "\n".join(map(written, [*lines[:1], *rest]))


def _entries(chart: Chart, look: Mapping[str, Look]) -> list[tuple[Any, str]]:
    """Return handles and words of the legend; none if there is one curve without a name."""
    marks = bool(chart.rows)
    found = [(Line2D([], [], **_style(look[name], marks)), written(label(name))) for name in look]
    if chart.others:
        grey = Line2D([], [], **_style(GREY, marks))
        found.append((grey, f"{len(chart.others)} other{'s' if chart.others[1:] else ''}"))
    for words, face in ((chart.hollow, "none"), (chart.filled, COLOURS["faint"])):
        if words:
            plain: dict[str, Any] = {"color": COLOURS["faint"], "markerfacecolor": face}
            found.append((Line2D([], [], marker="o", linestyle="none", **plain), written(words)))
    return found


def _style(look: Look, marks: bool) -> dict[str, Any]:
    """Return the style of a line with marks, or of marks only."""
    colour = COLOURS[look.colour]
    style: dict[str, Any] = {"color": colour, "linestyle": "none" if marks else look.line}
    style |= {"marker": look.marker, "markersize": 5.5 if marks else 4.2}
    if look is GREY:
        style |= {"alpha": 0.5, "linewidth": 1.0, "marker": "o" if marks else "none"}
        style |= {"markersize": 3.0, "zorder": 1.5}
    return style


class _Drawer:
    """Draws the panels of one chart."""

    def __init__(self, chart: Chart, look: Mapping[str, Look]) -> None:
        self._chart, self._look = chart, look
        self._order = list(look)
        names = max((min(len(name), _ROW) for name in chart.rows), default=6)
        columns = max(1, min(chart.columns, len(chart.panels)))
        self._letters = (_PLAIN * WIDTH - names) / columns - 4
        self._numbers = {name: i for i, name in enumerate(chart.solvers)}

    def draw(self, ax: Axes, panel: Panel) -> None:
        """Draw the curves of a panel: the grey ones below."""
        for one in sorted(panel.series, key=lambda one: one.solver in self._look):
            for artist in self._drawn(ax, one):
                artist.set_gid(f"series-{self._numbers[one.solver]}")
        if panel.across is not None:
            ax.axhline(panel.across, color=COLOURS["faint"], linewidth=0.8, dashes=(2, 2))

    def scale(self, ax: Axes) -> None:
        """Set up the axes of a panel, when all panels that share them have their curves."""
        _scale(ax, "x", self._chart.x, self._letters)
        if self._chart.rows:
            names = [_lines(name, _ROW) for name in self._chart.rows]
            ax.set_yticks(range(len(names)), names)
            ax.set_ylim(len(names) - 0.5, -0.5)
        else:
            _scale(ax, "y", self._chart.y, _LINES, is_upright=True)

    def _drawn(self, ax: Axes, one: Series) -> list[Artist]:
        style = _style(self._look.get(one.solver, GREY), marks=one.form != LINE)
        if self._chart.rows:
            return self._marks(ax, one, style)
        if one.solver in self._look:
            _between(ax, one, style)
            style["markevery"] = _every(one, self._order.index(one.solver))
        elif len(one.x) <= 3 * _MARKS:
            style["marker"] = "."
        return list(ax.plot(one.x, one.y, **style))

    def _marks(self, ax: Axes, one: Series, style: dict[str, Any]) -> list[Artist]:
        """Draw marks in their rows, each solver a little below the one before."""
        y = one.y + self._aside(one.solver)
        faint = {"color": style["color"], "linewidth": 0.9, "alpha": 0.55}
        if one.form == SPAN:
            found: list[Artist] = []
            for i in range(0, len(y), 2):
                ax.plot(one.x[i : i + 2], y[i : i + 2], **faint)
                found += ax.plot(one.x[i], y[i], **style, markerfacecolor="none")
                found += ax.plot(one.x[i + 1 : i + 2], y[i + 1 : i + 2], **style)
            return found
        if np.size(one.low) and one.solver in self._look:
            ax.hlines(y, one.low, one.high, **faint)
        return list(ax.plot(one.x, y, **style))

    def _aside(self, solver: str) -> float:
        """Return how far from the middle of its row a labelled solver is drawn."""
        if solver not in self._look:
            return 0.0
        return 0.7 * ((self._order.index(solver) + 0.5) / len(self._order) - 0.5)


def _between(ax: Axes, one: Series, style: Mapping[str, Any]) -> None:
    if np.size(one.low):
        ax.fill_between(one.x, one.low, one.high, color=style["color"], alpha=0.13, linewidth=0)


def _every(one: Series, i: int) -> Any:
    """Return at which points a line has its marks: at all of a few, else spread and staggered."""
    count = len(one.x)
    if count <= 3 * _MARKS:
        return None
    places = (np.arange(_MARKS) + (i % 6 + 0.5) / 6) / _MARKS
    return sorted(set((places * (count - 1)).astype(int).tolist()))


def _scale(ax: Axes, which: str, axis: Axis, room: float, is_upright: bool = False) -> None:
    """Set an axis up: its scale, its limits, and as many ticks as fit, by letters or by lines."""
    along = ax.xaxis if which == "x" else ax.yaxis
    if axis.log:
        (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    if axis.limits != (None, None):
        (ax.set_xlim if which == "x" else ax.set_ylim)(*axis.limits)
    low, high = sorted(along.get_view_interval())
    write = power if axis.log and (low < 1e-3 or high > 1e7) else _plain
    values = ticks(low, high, axis.log, room, lambda x: 1.8 if is_upright else len(write(x)) + 1.5)
    along.set_major_locator(mpl.ticker.FixedLocator(values))
    along.set_minor_locator(mpl.ticker.NullLocator())
    along.set_major_formatter(mpl.ticker.FuncFormatter(write))


def ticks(
    low: float, high: float, log: bool, room: float, size: Callable[[float], float]
) -> list[float]:
    """Return as many round values between two ends as have labels that stand apart, or two.

    The label of a value takes its size, with a gap, of the room along the axis.
    """
    scale: Callable[[Any], Any] = np.log10 if log else np.asarray
    sets = [v[(v >= low) & (v <= high)].tolist() for v in _round_values(low, high, log)]
    sets = [values for values in sets if len(values) > 1]
    for values in sets:
        sizes = np.array([*map(size, values)])
        distances = room * np.diff(scale(values)) / (scale(high) - scale(low))
        if (distances >= (sizes[1:] + sizes[:-1]) / 2).all():
            return values
    return [sets[0][0], sets[0][-1]] if sets else []


def _round_values(low: float, high: float, log: bool) -> list[Any]:
    """Return sets of round values from end to end and beyond, the largest first."""
    even = [mpl.ticker.MaxNLocator(n, steps=[1, 2, 5, 10]).tick_values(low, high) for n in _STEPS]
    if not log:
        return even
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    decades = [10.0 ** np.arange(first // n * n, last + 1, n) for n in range(1, last - first + 1)]
    fine = np.outer(decades[0], (1, 2, 5)).ravel()
    return [fine, *decades, *even] if high < 100 * low else decades


def _plain(x: float, _: float = 0) -> str:
    return f"{x:,.10g}"


def power(x: float, _: float = 0) -> str:
    """Return a power of ten in letters of one size, which stay legible and are found as text."""
    exponent = np.floor(np.log10(x) + 1e-9)
    factor = f"{x / 10**exponent:.3g}·".removeprefix("1·")
    return f"{factor}10" + f"{exponent:.0f}".translate(_RAISED)
