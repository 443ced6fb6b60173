"""What the records say of a solver over all robots, and how far it is from the best on each."""

from collections import Counter
from collections.abc import Sequence, Set
from typing import NamedTuple

import numpy as np

from ....harness import metrics
from ....harness.metrics import Floats, Interval, Ranking, Share
from ....harness.record import Record
from ....harness.results import Results, listed
from ....tables.table import words
from ..readings import (
    SHIFT,
    by_robot,
    false_claims,
    is_ranked,
    measured,
    outcomes,
    penalised,
    ranked_by_success,
    records_of,
    solved,
    total,
)

# Over so many sets of robots solvers are compared: the largest, where they take different ones.
SETS = 3


class Overall(NamedTuple):
    """A solver over a set of robots.

    Attributes:
        robots: which ones, in words.
        solver: by whom.
        records: its record of each robot, in one order for all solvers.
        success: who solves the most, of the solvers that are ranked.
        time: who takes the least time, likewise.
    """

    robots: str
    solver: str
    records: list[Record]
    success: Ranking = Ranking((), ())
    time: Ranking = Ranking((), ())

    @property
    def is_ranked(self) -> bool:
        """Whether it was given all targets of each robot, and the same ones as others."""
        return all(map(is_ranked, self.records))

    @property
    def solved(self) -> np.ndarray:
        """Which targets of all robots are solved, (target,)."""
        return np.concatenate([solved(record) for record in self.records])

    @property
    def share(self) -> Share:
        """How many targets of all robots are solved."""
        return metrics.share(self.solved)

    @property
    def penalised(self) -> Floats:
        """How long each target took, or the penalty where it is not solved [s], (target,)."""
        return np.concatenate([penalised(record) for record in self.records])

    @property
    def score(self) -> Interval:
        """The geometric mean of those times [s], targets drawn again within each robot."""
        groups = [total(record) for record in self.records]
        return metrics.shifted_geometric_mean(self.penalised, SHIFT, groups)

    @property
    def false_claims(self) -> int | None:
        """How many claims the evaluation denies; None if the solver makes none."""
        counts = [n for record in self.records if (n := false_claims(record)) is not None]
        return sum(counts) if counts else None

    def count(self, outcome: str) -> int:
        """Return to how many targets something came."""
        return sum(outcomes(record)[outcome] for record in self.records)

    @property
    def cut(self) -> str:
        """Why it is not ranked, "" if it is."""
        if self.is_ranked:
            return ""
        begun = sum(record.arrays["solved"].size for record in self.records)
        count = sum(map(total, self.records))
        return f"cut at {words(begun)} of {words(count)}" if begun < count else "other targets"

    @property
    def marks(self) -> str:
        """Where it is first or ties with the first, where it was cut short, what it raised."""
        rankings = (("most solved", self.success), ("least time", self.time))
        first = (f"{what}{_tie(of)}" for what, of in rankings if self.solver in of.first)
        troubles = [record.trouble for record in self.records if record.trouble]
        return "; ".join(filter(None, (self.cut, ", ".join(first), *troubles[:1])))


def _tie(ranking: Ranking) -> str:
    return " (tie)" if len(ranking.first) > 1 else ""


def overall(results: Results, kind: str) -> list[Overall]:
    """Return every solver over each set of robots that it takes, the largest sets first.

    Solvers are compared only over robots that all of them take.
    """
    records = measured(records_of(results, kind))
    sets = {frozenset(mine) for mine in _by_solver(records).values()}
    largest = sorted(sets, key=lambda robots: (-len(robots), sorted(robots)))[:SETS]
    return [row for robots in largest for row in overall_on(robots, records)]


def overall_on(robots: Set[str], records: Sequence[Record]) -> list[Overall]:
    """Return every solver that takes all of these robots, over them."""
    present = by_robot(records)
    names = [robot for robot in present if robot in robots]
    title = _title(names, len(present))
    takers = {s: mine for s, mine in _by_solver(records).items() if robots <= mine.keys()}
    return _ranked([Overall(title, s, [mine[r] for r in names]) for s, mine in takers.items()])


def _by_solver(records: Sequence[Record]) -> dict[str, dict[str, Record]]:
    """Return the record of each robot that a solver takes."""
    solvers: dict[str, dict[str, Record]] = {}
    for robot, mine in by_robot(records).items():
        for record in mine:
            solvers.setdefault(record.solver, {})[robot] = record
    return solvers


def _title(names: Sequence[str], count: int) -> str:
    if len(names) == 1:
        return names[0]
    return f"all {count} robots" if len(names) == count else listed(names)


def _ranked(rows: Sequence[Overall]) -> list[Overall]:
    """Return rows on one set of robots with who is first among them."""
    ranked = [row for row in rows if row.is_ranked]
    success = metrics.ranking({row.solver: row.solved for row in ranked})
    time = metrics.ranking({row.solver: -np.log(row.penalised + SHIFT) for row in ranked})
    return [row._replace(success=success, time=time) for row in rows]


class Line(NamedTuple):
    """A solver, its record of each robot, and the least geometric mean of anyone there [s]."""

    solver: str
    records: dict[str, Record]
    best: dict[str, float]

    def share(self, robot: str) -> Share | None:
        """Return how many targets of a robot it solves, None if it does not take it."""
        record = self.records.get(robot)
        return None if record is None else metrics.share(solved(record))

    def times_the_best(self, robot: str) -> float | None:
        """Return its geometric mean of times over the least, None if it does not take the robot."""
        record = self.records.get(robot)
        return None if record is None else metrics.ratio(_score(record), self.best[robot])

    def is_cut(self, robot: str) -> bool:
        """Return whether it is not ranked on a robot that it takes."""
        return robot in self.records and not is_ranked(self.records[robot])


def most_solved(made: Sequence[Line]) -> Counter[str]:
    """Return on how many robots each solver solves the most targets, or ties with who does."""
    robots = dict.fromkeys(robot for line in made for robot in line.records)
    rankings = [
        ranked_by_success([line.records[robot] for line in made if robot in line.records])
        for robot in robots
    ]
    return Counter(solver for ranking in rankings for solver in ranking.first)


def lines(results: Results, kind: str) -> list[Line]:
    """Return every solver with what it comes to on each robot."""
    records = measured(records_of(results, kind))
    best = {name: min(map(_score, mine)) for name, mine in by_robot(records).items()}
    return [Line(solver, mine, best) for solver, mine in _by_solver(records).items()]


def _score(record: Record) -> float:
    logs = np.log(penalised(record) + SHIFT)
    return float(np.exp(np.mean(logs)) - SHIFT)
