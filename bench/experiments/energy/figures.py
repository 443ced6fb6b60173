"""The energy that every integrator leaves, against the time."""

from ...presentation.figures import (
    Drawing,
    canvas,
    every_handle,
    finished,
    legend_height,
    nth_style,
    written,
)
from ...presentation.results import Results, by_problem, label, solvers


def energy(results: Results) -> Drawing | None:
    """Draw the energy that each integrator leaves against the time, without dampers and with."""
    records = results.all("energy")
    if not records:
        return None
    groups, shown = list(by_problem(records).values()), solvers(records)
    with canvas(3.2 + legend_height(shown, 3), len(groups), sharey=True) as (figure, axes):
        for ax, group in zip(axes, groups, strict=True):
            for record in group:
                style = nth_style(shown.index(record.solver))
                ax.plot(
                    record.arrays["time"],
                    record.arrays["left"],
                    label=written(label(record.solver)),
                    **style,
                )
            ax.set(title=written(group[0].title), xlabel="time [s]", xlim=(0, None))
        axes[0].set(ylabel="energy above rest, of the start", ylim=(0, None))
        figure.legend(*every_handle(axes), loc="outside lower left", ncols=3)
        return finished(
            figure,
            "energy",
            "Energy of a swinging cloth by integrator",
            "Without dampers all energy should stay. Lines that cover each other are the same "
            "method.",
        )
