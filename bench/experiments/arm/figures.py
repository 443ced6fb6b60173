"""The largest rotation of a joint between frames, on every curve."""

from typing import Any

from matplotlib.axes import Axes

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.figures import (
    COLOURS,
    Drawing,
    canvas,
    finished,
    legend_height,
    plain_powers,
    written,
)
from ...presentation.results import Results, by_problem, label, solvers
from ...presentation.tables import in_unit
from . import CURVE


def jitter(results: Results) -> Drawing | None:
    """Draw the largest rotation of a joint on each curve, from rest and from the last solution."""
    records = results.all("arm", task=CURVE, warm=False)
    if not records:
        return None
    rows = by_problem(records)
    curves, names = list(rows), solvers(records)
    height = 0.32 * len(curves) + 1.1 + legend_height(names, 1)
    with canvas(height, 1) as (figure, axes):
        for record in records:
            colour, _, marker = registry.find(record.solver).style
            y = curves.index(record.problem) + _aside(record.solver, names)
            warm = results.one("arm", record.problem, record.solver, warm=True)
            ends = [_largest_angle(r) for r in (record, warm) if r is not None]
            axes[0].plot(ends, [y] * len(ends), color=COLOURS[colour], linewidth=0.9, alpha=0.6)
            for x, filled in zip(ends, ("none", COLOURS[colour]), strict=False):
                style: dict[str, Any] = {"color": COLOURS[colour], "markerfacecolor": filled}
                name = _once(axes[0], written(label(record.solver)), filled)
                axes[0].plot(x, y, marker, markersize=5.5, linestyle="none", label=name, **style)
        labels = [written(of[0].facts["curve"]) for of in rows.values()]
        axes[0].set_yticks(range(len(curves)), labels)
        axes[0].set(
            xscale="log", xlabel="largest rotation of a joint between frames [°], log scale"
        )
        axes[0].invert_yaxis()
        plain_powers(axes[0])
        figure.legend(loc="outside upper right", ncols=2)
        return finished(
            figure,
            "jitter",
            "Largest rotation of a joint between neighbouring frames",
            "Hollow: every frame solved from the rest pose; filled: every frame started from the "
            "last solution.",
        )


def _largest_angle(record: Record) -> float:
    return in_unit(metrics.spread(record.arrays["largest_angle"]).largest, "°")


def _aside(solver: str, names: list[str]) -> float:
    """Return how far from the middle of its row a solver is drawn, so that none covers another."""
    return 0.6 * ((names.index(solver) + 0.5) / len(names) - 0.5)


def _once(ax: Axes, solver: str, filled: str) -> str | None:
    name = f"{solver}, {'from rest' if filled == 'none' else 'from the last solution'}"
    return None if name in ax.get_legend_handles_labels()[1] else name
