"""How often, and how closely, every solver meets its target within reach."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, by_problem, label, leaders, settings
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    P95,
    SOLVER,
    allowed,
    effort,
    iterations,
    remark,
    share,
    spread,
    text,
    titled,
)
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from ..chain import BEYOND, CHAIN
from ..chain import figures as chain
from . import CURVE

STARTS = {None: "random", False: "rest", True: "last solution"}


def _within_reach(results: Results) -> list[Record]:
    records = results.all("arm", task=CURVE, warm=False)
    records += results.all("arm", task=CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.facts["stratum"] != BEYOND]
    return [record for group in by_problem(records).values() for record in group]


def _met(record: Record) -> Any:
    return record.arrays["residual"] <= record.settings["tolerance"]


def _start(record: Record) -> str:
    return STARTS[record.settings.get("warm")]


def _summary(records: Sequence[Record]) -> Summary:
    """Say what each solver comes to, and who is first of those that take all problems."""
    hits: dict[str, dict[tuple[str, str], metrics.Floats]] = {}
    for record in records:
        hits.setdefault(record.solver, {})[record.problem, _start(record)] = _met(record)
    every = {at: hit.size for mine in hits.values() for at, hit in mine.items()}
    joined = {label(s): np.concatenate(list(mine.values())) for s, mine in hits.items()}
    complete = {
        label(solver): np.concatenate([mine[at] for at in every])
        for solver, mine in hits.items()
        if {at: hit.size for at, hit in mine.items()} == every
    }
    first = f"; first: {leaders(metrics.ranking(complete))}" if len(complete) > 1 else ""
    points = (f"{name}: {words(metrics.share(hit))}" for name, hit in joined.items())
    return Summary(f"Solved within tolerance, over all these problems{first}:", tuple(points))


accuracy = Layout(
    "How often, and how closely, is the target met?",
    "accuracy",
    "Success and residuals within reach",
    columns=(
        titled("problem"),
        text("start", _start),
        SOLVER,
        share("within tolerance", _met, best="greatest"),
        *spread("residual", "residual", "m", (LARGEST,)),
        Column(
            "time, median", "µs", read=lambda r: effort(r).median if "seconds" in r.arrays else None
        ),
        *iterations((MEDIAN,)),
        allowed(),
        remark(),
        *(
            replace(column, folded=True)
            for column in (
                *spread("residual", "residual", "m", (MEDIAN, P95)),
                *iterations((P95, LARGEST)),
            )
        ),
    ),
    subjects=_within_reach,
    shows=lambda records: (
        f"A solve succeeds if the effector is within {settings(records, 'tolerance')} m of "
        "its target. Residuals are not cut off at the tolerance. The interval is Wilson’s; solvers "
        "tie unless one solves so many more of the same targets that chance would do as much in "
        "less than 5 % of cases (McNemar’s exact test)."
    ),
    measured=lambda records: (
        "Residuals recomputed by forward kinematics of the rotations returned, whatever "
        "the solver says. Starts: the arm’s rest pose, the last frame’s solution, or seeded random "
        f"rotations. At most {settings(records, 'max_iterations')} iterations. Targets of the "
        "chain are timed one by one, each by a call from Python."
    ),
    summary=_summary,
    figures=(chain.ik_residuals,),
    compared=2,
)


LAYOUTS = (accuracy,)
