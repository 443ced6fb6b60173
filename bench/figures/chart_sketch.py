"""Sketches of charts, which import the drawing only when drawn."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from .chart import Axis, Chart, Panel
from .sketch import Sketch

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def chart_sketch(chart: Chart) -> Sketch | None:
    """Return the sketch of a chart, None if the chart has no curves."""
    if not any(panel.series for panel in chart.panels):
        return None
    return Sketch(chart.name, chart.title, chart.caption, chart, _draw_chart)


def _draw_chart(chart: Chart) -> "Figure":
    from .drawing import draw_chart

    return draw_chart(chart)


def declared_chart(
    declared: Mapping[str, Any],
    panels: Iterable[Panel],
    user_solvers: frozenset[str],
    **fields: Any,
) -> Sketch | None:
    """Return the sketch of a chart declared in a file of captions; None without panels.

    `fields` are the undeclared or different fields of `Chart`.
    """
    chart = {"panels": tuple(panels), "user_solvers": user_solvers, **declared, **fields}
    for name in ("x", "y"):
        axis = {"limits": (), **chart.get(name, {})}
        chart[name] = Axis(**{**axis, "limits": (*axis["limits"], None, None)[:2]})
    return chart_sketch(Chart(**chart)) if chart["panels"] else None
