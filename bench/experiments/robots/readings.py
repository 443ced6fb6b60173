"""What the records on robots say: shares of the targets, against time and against the fastest."""

from collections.abc import Sequence

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers.registry import ONE_START, RESTARTS
from ...presentation.results import Results
from . import REACHABLE

KINDS = {ONE_START: "one_start", RESTARTS: "restarts"}
# A solver that was given less than this part of the targets, an eighth, is in no profile.
ENOUGH = 8


def records_of(results: Results, kind: str, task: str = REACHABLE) -> list[Record]:
    """Return the records on robots of one kind, robot by robot."""
    wanted = [r for r in results.all("ik", task=task) if r.settings.get("kind") in (kind, "any")]
    order = list(dict.fromkeys(record.title for record in (*measured(wanted), *wanted)))
    return sorted(wanted, key=lambda record: order.index(record.title))


def measured(records: Sequence[Record]) -> list[Record]:
    """Return the records with targets in them."""
    return [record for record in records if "solved" in record.arrays]


def by_robot(records: Sequence[Record]) -> dict[str, list[Record]]:
    """Return the records with targets in them, robot by robot."""
    robots: dict[str, list[Record]] = {}
    for record in measured(records):
        robots.setdefault(record.title, []).append(record)
    return robots


def budget_curve(record: Record, budgets: np.ndarray) -> np.ndarray:
    """Return the share of the targets within reach solved within each budget [s]."""
    return metrics.within_budget(record.arrays["seconds"], record.arrays["solved"], budgets)


def budget_curves(
    records: Sequence[Record], budgets: np.ndarray
) -> dict[str, dict[str, np.ndarray]]:
    """Return the share solved within each budget [s], by robot and solver."""
    return {
        robot: {record.solver: budget_curve(record, budgets) for record in mine}
        for robot, mine in by_robot(records).items()
    }


def profiles(records: Sequence[Record], ratios: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """Return the profile of each solver on each robot, over the targets given to all of them."""
    return {robot: _profiles(mine, ratios) for robot, mine in by_robot(records).items()}


def _profiles(records: Sequence[Record], ratios: np.ndarray) -> dict[str, np.ndarray]:
    most = max(len(record.arrays["solved"]) for record in records)
    near = [record for record in records if ENOUGH * len(record.arrays["solved"]) >= most]
    least = min(len(record.arrays["solved"]) for record in near)
    seconds, solved = (
        np.array([record.arrays[name][:least] for record in near]) for name in ("seconds", "solved")
    )
    curves = metrics.performance_profiles(seconds, solved, ratios)
    return {record.solver: curve for record, curve in zip(near, curves, strict=True)}
