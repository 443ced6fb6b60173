"""What records on robots say of a solver: how many targets it solves, in what time.

A solver that a budget of time cut short is scored over all targets that it was given: those that it
never began count as not solved. It has a mark, and is not ranked; nor is one whose record is of
other targets than those of most solvers.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.metrics import Floats, Interval, Ranking, Share, Spread
from ...harness.record import Record
from ...peers import registry
from ...peers.registry import ONE_START, RESTARTS
from ...problems.robots import LIMIT_TOLERANCE
from ...tables.results import Results, listed
from ...tables.table import words
from . import REACHABLE, UNREACHABLE

STARTS = (ONE_START, RESTARTS)
# What a target that is not solved counts for in a mean of times [s], if it did not take longer.
PENALTY = 0.1
# Added to times before their geometric mean is taken, so that microseconds do not decide [s].
SHIFT = 1e-5
# Solvers are compared over so many sets of robots: the largest, where they take different ones.
SETS = 3
# What can become of a target; each counts under the first that is so.
CRASH = "exception or crash"
OUTCOMES = ("solved", "beyond a limit", "wrong claim", "missed", CRASH, "no answer", "not begun")
NO_RANKING = Ranking((), ())


class Score(NamedTuple):
    """A solver over all targets of one robot, or of several.

    Attributes:
        robots: which ones, in words.
        start: one start or restarts, "" where solvers are not told apart so.
        records: its record of each robot, in one order for all solvers.
        has_same_targets: whether it was given the targets of most solvers.
        success, time: who of those ranked solves the most of the same targets; who is fastest.
        least_time: the least geometric mean of times of any solver [s].
        best_distances: the least distance within limits of any solver, out of reach [m], (target,).
    """

    robots: str
    start: str
    solver: str
    records: tuple[Record, ...]
    has_same_targets: bool = True
    success: Ranking = NO_RANKING
    time: Ranking = NO_RANKING
    least_time: float = np.nan
    best_distances: Floats = np.zeros(0)

    @property
    def total(self) -> int:
        """How many targets it was given, begun or not."""
        return sum(map(_total, self.records))

    def begun(self, name: str) -> np.ndarray:
        """Return an array of the targets that were begun, (target,)."""
        return np.concatenate([record.arrays[name] for record in self.records])

    def all(self, name: str, value: float) -> np.ndarray:
        """Return an array of all targets, with a value for those never begun, (target,)."""
        return np.concatenate([_padded(record, name, value) for record in self.records])

    @property
    def solved(self) -> np.ndarray:
        """Which of all targets are solved, (target,)."""
        return self.all("solved", False)

    @property
    def share(self) -> Share:
        """How many of all targets are solved."""
        return metrics.share(self.solved)

    def solved_in_stratum(self, stratum: int) -> np.ndarray:
        """Return which of all targets in a stratum are solved, (target,)."""
        return self.solved[np.concatenate(list(map(_strata, self.records))) == stratum]

    @property
    def seconds(self) -> Floats:
        """How long each target took, infinite where it was never begun [s], (target,)."""
        return self.all("seconds", np.inf)

    @property
    def penalised(self) -> Floats:
        """How long each target took, or the penalty where it is not solved [s], (target,)."""
        return metrics.penalised(self.seconds, self.solved, PENALTY)

    @property
    def mean_time(self) -> float:
        """The geometric mean of those times [s]."""
        return float(np.exp(np.mean(np.log(self.penalised + SHIFT))) - SHIFT)

    @property
    def mean_time_interval(self) -> Interval:
        """The same with its interval [s], targets drawn again within each robot."""
        return metrics.shifted_geometric_mean(self.penalised, SHIFT, [*map(_total, self.records)])

    @property
    def times_the_least(self) -> float:
        """The geometric mean of times over the least of any solver."""
        return metrics.ratio(self.mean_time, self.least_time)

    @property
    def effort(self) -> metrics.Effort:
        """Where the times of targets begun lie [s]."""
        return metrics.effort(self.begun("seconds"))

    @property
    def median_time(self) -> Interval:
        """The median time of targets begun, and its interval [s]."""
        return metrics.median_interval(self.begun("seconds"))

    def residual(self, name: str) -> Spread:
        """Return where the residuals of targets solved lie, NaN if none is."""
        return metrics.spread(self.begun(name)[self.begun("solved")])

    @property
    def claims(self) -> int:
        """Of how many targets it says whether they are solved."""
        return int(np.sum(self.begun("claimed") >= 0))

    @property
    def false_claim_share(self) -> Share:
        """How many of the targets begun it calls solved, and the evaluation does not."""
        return metrics.share((self.begun("claimed") == 1) & ~self.begun("solved"))

    @property
    def false_claims(self) -> int | None:
        """How many these are; None if the solver makes no claims."""
        return self.false_claim_share.hits if self.claims else None

    @property
    def outcomes(self) -> Counter[str]:
        """How many targets came to what; together they are all that the solver was given."""
        return sum(map(_outcomes, self.records), Counter())

    @property
    def distances(self) -> Floats:
        """How far each target begun was missed; NaN without an answer that keeps limits [m]."""
        return np.where(self.begun("beyond") <= LIMIT_TOLERANCE, self.begun("position"), np.nan)

    @property
    def answers_within_limits(self) -> int:
        """How many answers keep all limits."""
        return int(np.isfinite(self.distances).sum())

    @property
    def excess_over_best(self) -> Spread:
        """By how much answers within limits miss more than the best known [m]."""
        return _spread(self.distances - self.best_distances[: self.distances.size])

    @property
    def excess_over_bound(self) -> Spread:
        """By how much answers within limits miss more than geometry makes them [m]."""
        bounds = [record.arrays.get("bound", np.nan) for record in self.records]
        return _spread(self.distances - np.hstack(bounds))

    @property
    def gap(self) -> Spread:
        """How far answers are from their targets, within limits or not [m]."""
        return _spread(self.begun("position"))

    @property
    def limits(self) -> str:
        """Why it is not ranked, "" if it is: its time ran out, or its targets are others."""
        begun = self.begun("solved").size
        cut = f"cut at {words(begun)} of {words(self.total)}" * (begun < self.total)
        others = f"other targets, {words(self.total)}" * (not self.has_same_targets)
        return "; ".join(filter(None, (cut, others)))

    @property
    def is_ranked(self) -> bool:
        """Whether it began all of its targets, and they are the same as others'."""
        return not self.limits

    @property
    def trouble(self) -> str:
        """What it first raised, "" if nothing."""
        return next((record.trouble for record in self.records if record.trouble), "")

    @property
    def leads(self) -> str:
        """Where it is first, or ties with the first."""
        rankings = {"most solved": self.success, "least time": self.time}
        return ", ".join(
            f"{name} (tie)" if len(ranking.first) > 1 else name
            for name, ranking in rankings.items()
            if self.solver in ranking.first
        )


def _spread(values: Floats) -> Spread:
    return metrics.spread(values[np.isfinite(values)])


def _total(record: Record) -> int:
    return max(int(record.size), record.arrays["solved"].size)


def _padded(record: Record, name: str, value: float) -> np.ndarray:
    begun = record.arrays[name]
    return np.pad(begun, (0, _total(record) - begun.size), constant_values=value)


def _strata(record: Record) -> np.ndarray:
    """Return the stratum of every target: they alternate, begun or not."""
    begun = record.arrays["stratum"]
    others = np.arange(begun.size, _total(record)) % max(len(record.details.strata), 1)
    return np.concatenate([begun, others])


def _outcomes(record: Record) -> Counter[str]:
    solves, details = record.values, record.details
    answered = np.isfinite(solves.position)
    reached = answered & (solves.position <= details.tolerance)
    reached &= solves.rotation <= details.tolerance_rotation
    raised = np.zeros_like(answered) if solves.exception is None else solves.exception
    claimed = answered & (solves.claimed == 1)
    holds = (solves.solved, reached, claimed, answered, raised, np.ones_like(answered))
    first = np.argmax(holds, axis=0)
    counts = Counter({name: int(np.sum(first == i)) for i, name in enumerate(OUTCOMES[:-1])})
    counts[OUTCOMES[-1]] = _total(record) - answered.size
    return counts


def scores(results: Results, task: str = REACHABLE) -> list[Score]:
    """Return every solver on every robot, robot by robot, those with one start first."""
    fields = [fields_of(results, start, task) for start in STARTS]
    robots = dict.fromkeys(robot for by_robot in fields for robot in by_robot)
    return [score for robot in robots for by_robot in fields for score in by_robot.get(robot, [])]


def fields_of(results: Results, start: str, task: str = REACHABLE) -> dict[str, list[Score]]:
    """Return every solver with a start, robot by robot."""
    return by_robot(results.all("ik", task=task, kind=start), start)


def by_robot(records: Iterable[Record], start: str = "") -> dict[str, list[Score]]:
    """Return who has records with targets in them: as registered, and then those unknown."""
    registered = [peer.label_of(entry) for peer in registry.PEERS for entry in peer.entries]
    places = {solver: place for place, solver in enumerate(registered)}
    robots: dict[str, list[Record]] = {}
    for record in records:
        if "solved" in record.arrays:
            robots.setdefault(record.title, []).append(record)
    for members in robots.values():
        members.sort(key=lambda record: places.get(record.solver, len(places)))
    return {robot: _field(robot, start, members) for robot, members in robots.items()}


def _field(robot: str, start: str, records: Sequence[Record]) -> list[Score]:
    """Return solvers on one robot; of equally many sets of targets the larger one counts."""
    counts = Counter(map(_total, records))
    size = max(counts, key=lambda size: (counts[size], size))
    return _ranked([Score(robot, start, r.solver, (r,), _total(r) == size) for r in records])


def _ranked(field: Sequence[Score]) -> list[Score]:
    """Return solvers on the same targets with who is first among them."""
    ranked = [score for score in field if score.is_ranked]
    success = metrics.ranking({score.solver: score.solved for score in ranked})
    time = metrics.ranking({s.solver: -np.log(s.penalised + SHIFT) for s in ranked})
    least = min((score.mean_time for score in field), default=np.nan)
    return [s._replace(success=success, time=time, least_time=least) for s in field]


def overall(results: Results) -> list[Score]:
    """Return every solver over each set of robots that it takes, the largest sets first.

    Solvers are compared only over robots that all of them take.
    """
    scores = [score for start in STARTS for score in over_sets(fields_of(results, start))]
    return sorted(scores, key=lambda score: -len(score.records))


def over_sets(fields: dict[str, list[Score]]) -> list[Score]:
    """Return every solver over each set of robots that some solver takes."""
    sets = {frozenset(members) for members in _by_solver(fields).values()}
    largest = sorted(sets, key=lambda robots: (-len(robots), sorted(robots)))[:SETS]
    return [score for robots in largest for score in together(robots, fields)]


def together(robots: Collection[str], fields: dict[str, list[Score]]) -> list[Score]:
    """Return every solver that takes all of these robots, over them."""
    names = [robot for robot in fields if robot in robots]
    title = title_of(names, [robot for robot in fields if robot not in robots])
    takers = [by for by in _by_solver(fields).values() if set(names) <= by.keys()]
    return _ranked([_joined(title, [by[name] for name in names]) for by in takers])


def title_of(names: Sequence[str], others: Sequence[str]) -> str:
    """Return what a set of robots is called: by those left out, if these are fewer."""
    if len(names) == 1:
        return names[0]
    if not others:
        return f"all {len(names)} robots"
    return f"all but {listed(others)}" if len(others) < len(names) else listed(names)


def _by_solver(fields: dict[str, list[Score]]) -> dict[str, dict[str, Score]]:
    """Return the score of each solver on each robot that it takes."""
    solvers: dict[str, dict[str, Score]] = {}
    for robot, field in fields.items():
        for score in field:
            solvers.setdefault(score.solver, {})[robot] = score
    return solvers


def _joined(title: str, parts: Sequence[Score]) -> Score:
    """Return the score of a solver over several robots."""
    records = tuple(record for part in parts for record in part.records)
    same = all(part.has_same_targets for part in parts)
    return parts[0]._replace(robots=title, records=records, has_same_targets=same)


def out_of_reach(results: Results) -> list[Score]:
    """Return every solver on targets out of reach, with the best answers known to them.

    The best known are those of any solver, with one start or more, to as many targets of a robot.
    """
    far = scores(results, UNREACHABLE)
    best: dict[tuple[str, int], Floats] = {}
    for score in far:
        key = (score.robots, score.solved.size)
        known = best.setdefault(key, np.full(key[1], np.inf))
        known[: score.distances.size] = np.fmin(known[: score.distances.size], score.distances)
    return [s._replace(best_distances=best[s.robots, s.solved.size]) for s in far]


def fields(scores: Iterable[Score]) -> dict[tuple[str, str], list[Score]]:
    """Return the solvers that are compared with one another, by robots and start."""
    groups: dict[tuple[str, str], list[Score]] = {}
    for score in scores:
        groups.setdefault((score.robots, score.start), []).append(score)
    return groups


def pooled_strata(scores: Sequence[Score]) -> list[tuple[str, Share]]:
    """Return how many targets of each stratum these solvers solve, the hardest stratum first."""
    names = scores[0].records[0].details.strata if scores else []
    shares = [
        (name, metrics.share(np.concatenate([score.solved_in_stratum(i) for score in scores])))
        for i, name in enumerate(names)
    ]
    return sorted(shares, key=lambda share: metrics.ratio(share[1].hits, share[1].total))


def spread_of_paces(records: Iterable[Record]) -> float:
    """Return by how much the pace of the machine varied, NaN if that is unknown."""
    paces = [float(r.conditions["pace"]) for r in records if r.conditions.get("pace")]
    return metrics.relative_spread(np.array(paces)) if len(paces) > 1 else np.nan


def within_budgets(field: Sequence[Score], budgets: Floats) -> list[tuple[Score, Floats]]:
    """Return the share of all targets that each solver solves within each budget [s]."""
    return [(score, metrics.within_budget(score.seconds, score.solved, budgets)) for score in field]


def profiles(field: Sequence[Score], ratios: Floats) -> list[tuple[Score, Floats]]:
    """Return the profile of each solver on a robot, over all targets that any of them solves.

    Solvers that were given other targets are left out.
    """
    same = [score for score in field if score.has_same_targets]
    seconds, solved = (np.array([getattr(s, name) for s in same]) for name in ("seconds", "solved"))
    return list(zip(same, metrics.performance_profiles(seconds, solved, ratios), strict=True))


def ratio_of_times(rival: Score, score: Score) -> metrics.PairedRatio:
    """Return by what factor a rival takes longer for the same targets, misses penalised."""
    return metrics.paired_ratio(rival.penalised + SHIFT, score.penalised + SHIFT)
