"""Residual and error of one implicit Euler step, iteration by iteration."""

import numpy as np

from ...peers import registry
from ...presentation.figures import (
    COLOURS,
    Drawing,
    canvas,
    finished,
    plain_powers,
    written,
)
from ...presentation.results import Results, label, problems
from .tables import ONE_STEP


def cloth_convergence(results: Results) -> Drawing | None:
    """Draw residual and error against the iteration of one step, a column for each stiffness."""
    records = [r for r in results.all("cloth") if r.problem.endswith(ONE_STEP)]
    if not records:
        return None
    names = problems(records)
    rows = {"residual": "residual", "error": "error |x − x*| / |y − x*|"}
    with canvas(4.6, len(names), rows=2, sharex=True, sharey=True) as (figure, axes):
        for i, (quantity, ylabel) in enumerate(rows.items()):
            for j, problem in enumerate(names):
                ax = axes[i * len(names) + j]
                for record in (r for r in records if r.problem == problem):
                    colour, line, _ = registry.find(record.solver).style
                    values = record.arrays[quantity]
                    shown = {"linestyle": line, "color": COLOURS[colour]}
                    k = np.arange(1, len(values))
                    ax.plot(k, values[1:], **shown, label=written(label(record.solver)))
                ax.set(xscale="log", yscale="log", ylim=(1e-14, 2))
                plain_powers(ax)
            axes[i * len(names)].set_ylabel(ylabel)
        for ax, problem in zip(axes, names, strict=False):
            ax.set_title(written(label(problem.removesuffix(ONE_STEP))))
        for ax in axes[len(names) :]:
            ax.set_xlabel("iteration, log scale")
        axes[0].legend(loc="upper right")
        return finished(
            figure, "cloth_convergence", "Convergence of one implicit Euler step",
            "Above the residual, below the error to the converged step; both are 1 at the start. "
            "Lines end in rounding.",
        )  # fmt: skip
