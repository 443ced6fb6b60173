"""Residual and error of one implicit Euler step, iteration by iteration."""

import numpy as np

from ...presentation.figures import Drawing, canvas, drawn_as, finished, plain_powers, written
from ...presentation.results import Results, by_problem
from . import ONE_STEP


def cloth_convergence(results: Results) -> Drawing | None:
    """Draw residual and error against the iteration of one step, a column for each stiffness."""
    cloths = list(by_problem(results.all("cloth", task=ONE_STEP)).values())
    if not cloths:
        return None
    rows = {"residual": "residual", "error": "error |x − x*| / |y − x*|"}
    with canvas(4.6, len(cloths), rows=2, sharex=True, sharey=True) as (figure, axes):
        for i, (quantity, ylabel) in enumerate(rows.items()):
            for j, records in enumerate(cloths):
                ax = axes[i * len(cloths) + j]
                for record in records:
                    values = record.arrays[quantity][1:]
                    ax.plot(np.arange(1, 1 + len(values)), values, **drawn_as(record.solver))
                ax.set(xscale="log", yscale="log", ylim=(1e-14, 2))
                plain_powers(ax)
            axes[i * len(cloths)].set_ylabel(ylabel)
        for ax, records in zip(axes, cloths, strict=False):
            ax.set_title(written(f"cloth, {records[0].title}"))
        for ax in axes[len(cloths) :]:
            ax.set_xlabel("iteration, log scale")
        axes[0].legend(loc="upper right")
        return finished(
            figure,
            "cloth_convergence",
            "Convergence of one implicit Euler step",
            "Above the residual, below the error to the converged step; both are 1 at the start. "
            "Lines end in rounding.",
        )
