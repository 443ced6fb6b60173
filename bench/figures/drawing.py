"""The drawing of charts.

Solvers differ in line and marker as well as in colour.
"""

import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from plumbob.text.printable import shortened

from ..tables.results import label
from .canvas import WIDTH, canvas
from .chart import GREY, LINE, SPAN, Axis, Chart, Panel, Series, looks
from .style import COLOURS, LONGEST, Style, plain_label

# Heights [inch] of a panel, of a row of marks, of a line of the legend.
PANEL, ROW, LEGEND = 2.6, 0.3, 0.19
# Distance of the names of curves, in heights of a panel.
_NAME = 0.11
# Letters per inch of bold and of plain type; letters of the name of a row.
_BOLD, _PLAIN, _ROW_NAME = 11.0, 13.0, 34
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Lines of the smallest letters beside a panel; numbers of steps between even ticks.
_LINES, _STEPS = 14.0, range(6, 1, -1)
# Marks along a line.
_MARKS = 5


def draw_chart(chart: Chart) -> Figure:
    """Return a chart drawn: panels, with names at the ends of curves, or a legend of marks."""
    columns = max(1, min(chart.columns, len(chart.panels)))
    rows = -(-len(chart.panels) // columns)
    drawer = _ChartDrawer(chart, columns)
    handles, names = drawer.legend() if chart.rows else ([], [])
    legend_columns = max(1, int(WIDTH / (max(map(len, names), default=0) / _PLAIN + 0.6)))
    panel_height = ROW * len(chart.rows) + 0.7 if chart.rows else PANEL
    height = panel_height * rows + 0.25 + LEGEND * -(-len(names) // legend_columns)
    figure, axes = canvas(height, columns, rows)
    for i, (ax, panel) in enumerate(zip(axes, chart.panels, strict=False)):
        drawer.draw(ax, panel)
        ax.set_title(_wrapped(panel.title, WIDTH / columns * _BOLD), y=1.0)
        ax.set_xlabel(_wrapped(chart.x.label, WIDTH / columns * _PLAIN))
        ax.tick_params(labelleft=i % columns == 0)
        if i % columns == 0 and (title := panel.label or chart.y.label):
            ax.set_ylabel(plain_label(title))
    for ax in axes[len(chart.panels) :]:
        ax.remove()
    drawer.scale(axes[: len(chart.panels)])
    if not chart.rows:
        for i in range(columns - 1, len(chart.panels), columns):
            drawer.name_curves(axes[i], chart.panels[i], all_solvers=i < columns)
    if names:
        figure.legend(handles, names, loc="outside lower left", ncols=legend_columns)
    figure.series_names = chart.solvers  # type: ignore[attr-defined]
    return figure


def _wrapped(text: str, width: float) -> str:
    """Return a text in lines of so many letters."""
    lines = textwrap.wrap(shortened(text, 2 * LONGEST), max(12, int(width)))
    return "\n".join(map(plain_label, lines))


def _style(look: Style, marks: bool) -> dict[str, Any]:
    """Return the style of a line with marks, or of marks only."""
    colour = COLOURS[look.colour]
    style: dict[str, Any] = {"color": colour, "linestyle": "none" if marks else look.line}
    style |= {"marker": look.marker, "markersize": 5.5 if marks else 4.2}
    if look is GREY:
        style |= {"alpha": 0.5, "linewidth": 1.0, "marker": "o" if marks else "none"}
        style |= {"markersize": 3.0, "zorder": 1.5}
    return style


class _ChartDrawer:
    """Draws the panels of a chart."""

    def __init__(self, chart: Chart, columns: int) -> None:
        self._chart, self._looks = chart, looks(chart.labelled)
        self._order = list(self._looks)
        names = max((min(len(name), _ROW_NAME) for name in chart.rows), default=6)
        self._letters = (_PLAIN * WIDTH - names) / columns - 4
        self._numbers = {name: i for i, name in enumerate(chart.solvers)}

    def legend(self) -> tuple[list[Line2D], list[str]]:
        """Return handles and names of the legend."""
        marks, count = bool(self._chart.rows), len(self._chart.unlabelled)
        entries = {
            plain_label(label(name)): _style(self._looks[name], marks) for name in self._order
        }
        if count:
            entries[f"{count} other{'s' if count > 1 else ''}"] = _style(GREY, marks)
        faint = COLOURS["faint"]
        for meaning, face in ((self._chart.hollow, "none"), (self._chart.filled, faint)):
            if meaning:
                plain = {"color": faint, "marker": "o", "linestyle": "none"}
                entries[plain_label(meaning)] = {**plain, "markerfacecolor": face}
        return [Line2D([], [], **style) for style in entries.values()], list(entries)

    def draw(self, ax: Axes, panel: Panel) -> None:
        """Draw the curves of a panel: grey curves below."""
        for curve in sorted(panel.series, key=lambda curve: curve.solver in self._looks):
            draw = self._draw_marks if self._chart.rows else self._draw_line
            for artist in draw(
                ax, curve, _style(self._looks.get(curve.solver, GREY), curve.form != LINE)
            ):
                artist.set_gid(f"series-{self._numbers[curve.solver]}")
        if panel.across is not None:
            ax.axhline(panel.across, color=COLOURS["faint"], linewidth=0.8, dashes=(2, 2))

    def name_curves(self, ax: Axes, panel: Panel, all_solvers: bool) -> None:
        """Write the names of labelled curves beside a panel, in the order of their ends.

        With all solvers, solvers without a curve in the panel follow.
        """
        low, high = sorted(ax.get_ylim())
        curves = {
            c.solver: (c.x[-1], min(max(c.y[-1], low), high)) for c in panel.series if c.x.size
        }
        to_axes = ax.transData + ax.transAxes.inverted()
        heights = {
            name: to_axes.transform(curves[name])[1] if name in curves else 0.0
            for name in self._order
            if all_solvers or name in curves
        }
        place, lowest = 1.0 + _NAME, _NAME * (len(heights) - 1)
        for name in sorted(heights, key=lambda name: -heights[name]):
            place = min(place - _NAME, max(heights[name], lowest))
            lowest -= _NAME
            colour, end = COLOURS[self._looks[name].colour], curves.get(name, (1.0, place))
            arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.6, "alpha": 0.6}
            arrow |= {"patchA": None, "relpos": (0.0, 0.5), "shrinkB": 0}  # without clipping
            is_drawn = name in curves
            ax.annotate(
                plain_label(label(name)),
                end,
                (1.06, place),
                "data" if is_drawn else "axes fraction",
                "axes fraction",
                arrowprops=arrow if is_drawn else None,
                color=colour,
                va="center",
                annotation_clip=False,
            )

    def scale(self, axes: Sequence[Axes]) -> None:
        """Set up the axes of the panels, with common limits; drawn curves are shared faster."""
        for ax in axes[1:]:
            ax.sharey(axes[0])
        if self._chart.rows:
            names = [_wrapped(name, _ROW_NAME) for name in self._chart.rows]
            axes[0].set_yticks(range(len(names)), names)
            axes[0].set_ylim(len(names) - 0.5, -0.5)
            for ax in axes:
                _set_axis(ax, "x", self._chart.x, self._letters)
            return
        for ax in axes[1:]:
            ax.sharex(axes[0])
        _set_axis(axes[0], "x", self._chart.x, self._letters)
        _set_axis(axes[0], "y", self._chart.y, _LINES)

    def _draw_line(self, ax: Axes, curve: Series, style: dict[str, Any]) -> list[Line2D]:
        if curve.solver in self._looks:
            if np.size(curve.low):
                band = {"color": style["color"], "alpha": 0.13, "linewidth": 0}
                ax.fill_between(curve.x, curve.low, curve.high, **band)
            style["markevery"] = _marked_points(len(curve.x), self._order.index(curve.solver))
        elif len(curve.x) <= 3 * _MARKS:
            style["marker"] = "."
        return list(ax.plot(curve.x, curve.y, **style))

    def _draw_marks(self, ax: Axes, curve: Series, style: dict[str, Any]) -> list[Line2D]:
        """Draw marks in their rows, each labelled solver a little below the last."""
        x, y = curve.x, curve.y
        is_labelled = curve.solver in self._looks
        if is_labelled:
            y = y + 0.7 * ((self._order.index(curve.solver) + 0.5) / len(self._order) - 0.5)
        faint = {"color": style["color"], "linewidth": 0.9, "alpha": 0.55}
        if curve.form == SPAN:
            artists = []
            for i in range(0, len(y), 2):
                ax.plot(x[i : i + 2], y[i : i + 2], **faint)
                artists += ax.plot(x[i], y[i], **style, markerfacecolor="none")
                artists += ax.plot(x[i + 1 : i + 2], y[i + 1 : i + 2], **style)
            return artists
        if np.size(curve.low) and is_labelled:
            ax.hlines(y, curve.low, curve.high, **faint)
        return list(ax.plot(x, y, **style))


def _marked_points(count: int, i: int) -> list[int] | None:
    """Return the points of curve i with marks, staggered; None for all of a few."""
    if count <= 3 * _MARKS:
        return None
    places = (np.arange(_MARKS) + (i % 6 + 0.5) / 6) / _MARKS
    return sorted(set((places * (count - 1)).astype(int).tolist()))


def _set_axis(ax: Axes, name: str, axis: Axis, space: float) -> None:
    """Set scale, limits and as many ticks as fit, by letters along x and by lines along y."""
    along = ax.xaxis if name == "x" else ax.yaxis
    if axis.log:
        ax.set(**{f"{name}scale": "log"})
    if axis.limits != (None, None):
        ax.set(**{f"{name}lim": axis.limits})
    low, high = sorted(along.get_view_interval())
    write = power if axis.log and (low < 1e-3 or high > 1e7) else _plain
    sizes = (lambda x: len(write(x)) + 1.5) if name == "x" else (lambda x: 1.8)
    along.set_major_locator(mpl.ticker.FixedLocator(ticks(low, high, axis.log, space, sizes)))
    along.set_minor_locator(mpl.ticker.NullLocator())
    along.set_major_formatter(mpl.ticker.FuncFormatter(write))


def ticks(
    low: float, high: float, log: bool, space: float, size: Callable[[float], float]
) -> list[float]:
    """Return as many round values between two ends as have labels without overlap, or two.

    The label of a value takes its size, with a gap, of the space along the axis.
    """
    scale: Callable[[Any], Any] = np.log10 if log else np.asarray
    sets = [v[(v >= low) & (v <= high)].tolist() for v in _round_values(low, high, log)]
    sets = [ends for ends in sets if len(ends) > 1]
    for places in sets:
        sizes = np.array([*map(size, places)])
        distances = space * np.diff(scale(places)) / (scale(high) - scale(low))
        if (distances >= (sizes[1:] + sizes[:-1]) / 2).all():
            return places
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
    """Return a power of ten with a raised exponent in letters of equal size, legible as text."""
    exponent = np.floor(np.log10(x) + 1e-9)
    factor = f"{x / 10**exponent:.3g}·".removeprefix("1·")
    return f"{factor}10" + f"{exponent:.0f}".translate(_RAISED)
