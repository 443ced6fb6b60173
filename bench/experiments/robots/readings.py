"""What the records on robots say: shares of all targets, against time and against the fastest.

A solver that a budget of time cut short is scored over all targets that it was given: those that it
never began count as not solved. It has a mark, and is not ranked; nor is one whose record is of
other targets than those of most solvers.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...harness import metrics
from ...harness.metrics import Floats, Ranking
from ...harness.record import Record
from ...harness.results import Results, settings, steadiness
from ...peers import registry
from ...peers.registry import ONE_START, RESTARTS
from ...tables.columns import words_in
from ...tables.table import words
from . import LIMIT_TOLERANCE, REACHABLE

KINDS = {ONE_START: "one_start", RESTARTS: "restarts"}
# What a target that is not solved counts for in a mean of times [s], if it did not take longer.
PENALTY = 0.1
# Added to times before their geometric mean is taken, so that microseconds do not decide [s].
SHIFT = 1e-5
MARK = "mark"
# What can become of a target; each counts under the first that is so.
CRASH = "exception or crash"
OUTCOMES = ("solved", "beyond a limit", "wrong claim", "missed", CRASH, "no answer", "not begun")

_MEASURED = (
    "Every solver has the same text of the robot (a solver of yours the same robot as the protocol "
    "writes it), the same targets and the same seeded random starts. It works in a process of its "
    "own, on one core (TRAC-IK on two), and is timed target by target, as in a loop of solves: "
    "after the target before, solved again without counting where that takes less than a "
    "millisecond; conversions are left out. The solvers of a robot follow each other in an order "
    "drawn by lot. What one returns is evaluated by MuJoCo’s kinematics of the same text. "
    "TRAC-IK’s limits of time pass sooner on a busy machine. Solved means: "
)
# The rule for solvers that a budget of time cut short.
RULE = (
    "All shares are of all targets given: a solver whose budget of time ran out is marked “cut "
    "at”, the targets that it never began count as not solved, and it is not ranked."
)
TIES = (
    "Solvers tie unless one does better on so many of the same targets that chance would do as "
    "much in less than 5 % of cases (McNemar’s exact test for success, Fisher’s "
    "randomisation test of differences for times; Holm’s correction over rivals)."
)
# What a geometric mean of times is.
SCORE = (
    f"The geometric mean is of times plus {words_in(SHIFT, 'µs')}, less that in the end; a target "
    f"that is not solved counts as {words_in(PENALTY, 'ms')}, or as what it took if that is longer."
)


def records_of(results: Results, kind: str, task: str = REACHABLE) -> list[Record]:
    """Return the records on robots of one kind, robot by robot, marked where they are not ranked.

    Solvers are in the order of the registry; those that it does not know follow.
    """
    wanted = [r for r in results.all("ik", task=task) if r.settings.get("kind") in (kind, "any")]
    robots = list(dict.fromkeys(record.title for record in (*measured(wanted), *wanted)))
    known = [peer.called(entry) for peer in registry.PEERS for entry in peer.entries]
    solvers = list(dict.fromkeys([*known, *(record.solver for record in wanted)]))
    wanted.sort(key=lambda r: (robots.index(r.title), solvers.index(r.solver)))
    return marked(wanted)


def marked(records: Sequence[Record]) -> list[Record]:
    """Return records with a mark where they are not of all targets, or of others than most are."""
    sizes = {robot: _commonest(mine) for robot, mine in by_robot(records).items()}
    return [_marked(record, sizes.get(record.title, 0)) for record in records]


def _commonest(records: Sequence[Record]) -> int:
    """Return how many targets most of the records are of, the more of equals."""
    counts = Counter(map(total, records))
    return max(counts, key=lambda size: (counts[size], size))


def _marked(record: Record, size: int) -> Record:
    if "solved" not in record.arrays:
        return record
    others = f"other targets, {total(record)}" if total(record) != size else ""
    marks = "; ".join(filter(None, (cut(record), others)))
    return replace(record, notes={**record.notes, MARK: marks})


def cut(record: Record) -> str:
    """Return where a budget of time ended a record's targets, "" if there was enough of it."""
    asked, begun = total(record), record.arrays["solved"].size
    return f"cut at {words(begun)} of {words(asked)}" if begun < asked else ""


def is_ranked(record: Record) -> bool:
    """Return whether a record is of the same targets as others, and of all of them."""
    return "solved" in record.arrays and not record.notes.get(MARK)


def measured(records: Sequence[Record]) -> list[Record]:
    """Return the records with targets in them."""
    return [record for record in records if "solved" in record.arrays]


def by_robot(records: Sequence[Record]) -> dict[str, list[Record]]:
    """Return the records with targets in them, robot by robot."""
    robots: dict[str, list[Record]] = {}
    for record in measured(records):
        robots.setdefault(record.title, []).append(record)
    return robots


def total(record: Record) -> int:
    """Return how many targets a solver was given, begun or not."""
    return max(int(record.size), record.arrays["solved"].size)


def solved(record: Record, stratum: int | None = None) -> np.ndarray:
    """Return which of all targets are solved, or of those in a stratum, (target,)."""
    begun = record.arrays["solved"]
    found = np.concatenate([begun, np.zeros(total(record) - begun.size, dtype=bool)])
    return found if stratum is None else found[_strata(record) == stratum]


def _strata(record: Record) -> np.ndarray:
    """Return the stratum of every target: they alternate, begun or not."""
    begun = record.arrays["stratum"]
    rest = np.arange(begun.size, total(record)) % max(len(record.facts["strata"]), 1)
    return np.concatenate([begun, rest])


def seconds(record: Record) -> Floats:
    """Return how long each target took, infinite where it was never begun [s], (target,)."""
    begun = record.arrays["seconds"]
    return np.concatenate([begun, np.full(total(record) - begun.size, np.inf)])


def penalised(record: Record) -> Floats:
    """Return how long each target took, or the penalty where it is not solved [s], (target,)."""
    return metrics.penalised(seconds(record), solved(record), PENALTY)


def false_claims(record: Record) -> int | None:
    """Return how many claims the evaluation denies; None if the solver makes none."""
    claimed = record.arrays["claimed"]
    if not any(claimed >= 0):
        return None
    return int(np.count_nonzero((claimed == 1) & ~record.arrays["solved"]))


def outcomes(record: Record) -> dict[str, int]:
    """Return how many targets came to what; together they are all that the solver was given."""
    arrays, settings = record.arrays, record.settings
    answered = np.isfinite(arrays["position"])
    reached = answered & (arrays["position"] <= settings["tolerance"])
    reached &= arrays["rotation"] <= settings["tolerance_rotation"]
    raised = arrays.get("exception", np.zeros(answered.size, dtype=bool))
    holds = (arrays["solved"], reached, answered & (arrays["claimed"] == 1), answered, raised)
    counts, left = [], np.ones(answered.shape, dtype=bool)
    for each in holds:
        counts.append(int(np.count_nonzero(left & each)))
        left &= ~each
    counts += [int(np.count_nonzero(left)), total(record) - answered.size]
    return dict(zip(OUTCOMES, counts, strict=True))


def ranked_by_success(records: Sequence[Record]) -> Ranking:
    """Return who solves the most of the same targets, and who is not told from that solver."""
    return metrics.ranking({r.solver: solved(r) for r in records if is_ranked(r)})


def ranked_by_time(records: Sequence[Record]) -> Ranking:
    """Return who has the least geometric mean of times, unsolved targets with their penalty."""
    return metrics.ranking(
        {r.solver: -np.log(penalised(r) + SHIFT) for r in records if is_ranked(r)}
    )


def best_known(records: Sequence[Record]) -> dict[tuple[str, int], Floats]:
    """Return the least distance within limits by which anyone missed each target [m], (target,).

    The records are of any solvers; the targets are those of a robot and their number.
    """
    best: dict[tuple[str, int], Floats] = {}
    for record in measured(records):
        known = best.setdefault((record.title, total(record)), np.full(total(record), np.inf))
        left = distances_within_limits(record)
        known[: left.size] = np.fmin(known[: left.size], left)
    return best


def distances_within_limits(record: Record) -> Floats:
    """Return how far each target begun was missed; NaN without an answer that keeps limits [m]."""
    kept = record.arrays["beyond"] <= LIMIT_TOLERANCE
    return np.where(kept, record.arrays["position"], np.nan)


def beyond_best(record: Record, best: Mapping[tuple[str, int], Floats]) -> Floats:
    """Return by how much more answers within limits miss than the best known [m], (answer,)."""
    left = distances_within_limits(record)
    found = left - best[record.title, total(record)][: left.size]
    return found[np.isfinite(found)]


def solved_within(record: Record, budget: float) -> np.ndarray:
    """Return which of all targets are solved within a budget [s], (target,)."""
    return solved(record) & (seconds(record) <= budget)


def budget_curve(record: Record, budgets: np.ndarray) -> np.ndarray:
    """Return the share of all targets that are solved within each budget [s]."""
    return metrics.within_budget(seconds(record), solved(record), budgets)


def budget_curves(
    records: Sequence[Record], budgets: np.ndarray
) -> dict[str, dict[str, np.ndarray]]:
    """Return the share solved within each budget [s], by robot and solver."""
    return {
        robot: {record.solver: budget_curve(record, budgets) for record in mine}
        for robot, mine in by_robot(records).items()
    }


def profiles(records: Sequence[Record], ratios: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """Return the profile of each solver on each robot, over all targets that any of them solves.

    Solvers that were given other targets are left out.
    """
    return {robot: _profiles(mine, ratios) for robot, mine in by_robot(records).items()}


def _profiles(records: Sequence[Record], ratios: np.ndarray) -> dict[str, np.ndarray]:
    same = _of_same_targets(records)
    taken, hits = (np.array([read(record) for record in same]) for read in (seconds, solved))
    curves = metrics.performance_profiles(taken, hits, ratios)
    return {record.solver: curve for record, curve in zip(same, curves, strict=True)}


def fastest(records: Sequence[Record]) -> dict[str, np.ndarray]:
    """Return on which targets each solver is the fastest, of those that any solves, (target,)."""
    same = _of_same_targets(records)
    taken = np.array([np.where(solved(record), seconds(record), np.inf) for record in same])
    best = taken.min(axis=0)
    possible = np.isfinite(best)
    hits = taken[:, possible] <= best[possible]
    return {record.solver: mine for record, mine in zip(same, hits, strict=True)}


def _of_same_targets(records: Sequence[Record]) -> list[Record]:
    """Return the records of as many targets as most are of."""
    size = _commonest(records)
    return [record for record in records if total(record) == size]


def how(records: Sequence[Record]) -> str:
    """Return how the numbers of records came about, and whether the machine was steady."""
    paces = [float(r.conditions["pace"]) for r in records if r.conditions.get("pace")]
    noise = metrics.relative_spread(np.array(paces)) if len(paces) > 1 else math.nan
    return (
        f"{_MEASURED}within {settings(records, 'tolerance')} m and "
        f"{settings(records, 'tolerance_rotation')} rad, every limit kept to "
        f"{words(LIMIT_TOLERANCE)} rad. {steadiness(noise)}"
    ).rstrip()
