"""How often, and how closely, every solver meets its target within reach."""

from collections.abc import Sequence
from typing import Any

from ...harness import metrics
from ...harness.record import Record
from ...presentation.columns import (
    LARGEST,
    MEDIAN,
    P95,
    SOLVER,
    folded,
    least,
    share,
    spread,
    text,
    titled,
)
from ...presentation.layout import Layout
from ...presentation.results import Results, by_problem, label, settings, solvers
from ...presentation.tables import Summary, words
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


def _summary(records: Sequence[Record]) -> Summary:
    points = []
    for solver in solvers(records):
        shares = [metrics.share(_met(record)) for record in records if record.solver == solver]
        hits, total = sum(share.hits for share in shares), sum(share.total for share in shares)
        points.append(f"{label(solver)}: {words(hits)} of {words(total)}")
    return Summary("Solved within tolerance, over all these problems:", tuple(points))


accuracy = Layout(
    "How often, and how closely, is the target met?",
    "accuracy",
    "Success and residuals within reach",
    columns=(
        titled("problem"),
        text("start", lambda record: STARTS[record.settings.get("warm")]),
        SOLVER,
        share("within tolerance", _met, best="greatest"),
        *least(spread("residual", "residual", "m", (MEDIAN, P95, LARGEST))),
        *folded(spread("iterations", "iterations", of=(MEDIAN, P95, LARGEST))),
    ),
    subjects=_within_reach,
    shows=lambda records: (
        f"A solve succeeds if the effector is within {settings(records, 'tolerance')} m of "
        "its target. Residuals are not cut off at the tolerance. The interval is Wilson’s."
    ),
    measured=lambda records: (
        "Residuals recomputed by forward kinematics of the rotations returned, whatever "
        "the solver says. Starts: the arm’s rest pose, the last frame’s solution, or seeded random "
        f"rotations. At most {settings(records, 'max_iterations')} iterations."
    ),
    summary=_summary,
    figures=(chain.ik_residuals,),
    compared=2,
)


LAYOUTS = (accuracy,)
