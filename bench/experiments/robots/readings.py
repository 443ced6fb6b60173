"""Scores of solvers on robots: the solved targets, and the times of the first targets.

A solver is unranked if unfinished, if a time limit ends its solves, or if its targets differ from
most solvers'. Robots for tuning, robots held out and the character are never averaged together.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.metrics import Floats, Ranking, Share
from ...harness.record import FIRST_TARGETS, Record
from ...peers import catalogue
from ...peers.peer import ONE_START, PORTFOLIO, RESTARTS
from ...problems.robot_targets import seed_indices
from ...problems.robots import LIMIT_TOLERANCE
from ...tables.results import Results, grouped, listed
from ...tables.table import words
from . import REACHABLE, UNREACHABLE

STARTS = (ONE_START, PORTFOLIO, RESTARTS)
# The least time of an unsolved target in a mean of times [s].
PENALTY = 0.1
# Added to times before their geometric mean is taken: microseconds must not decide [s].
SHIFT = 1e-5
# Solvers with different robots of a group are compared over the two largest sets.
SETS = 2
# The outcomes of a target, counted under the first to apply.
OUTCOMES = (
    *("solved", "beyond a limit", "wrong claim", "missed"),
    *("exception or crash", "no answer", "not begun"),
)
_NO_RANKING = Ranking((), ())


class Score(NamedTuple):
    """A solver over all targets of a robot, or of several."""

    robots: str  # their names, or a phrase
    start: str  # one of `STARTS`, "" if all are in one field
    solver: str  # as records call it
    records: tuple[Record, ...]  # its record of each robot, in the same order for all solvers
    has_same_targets: bool = True  # whether it was given the targets of most solvers
    success: Ranking = _NO_RANKING  # the ranking of the solvers by targets solved
    time: Ranking = _NO_RANKING  # the ranking by time for the same targets
    least_time: float = np.nan  # the least geometric mean of times of any solver [s]
    # the least distance within limits of any solver, out of reach [m], (target,)
    best_distances: Floats = np.zeros(0)

    @property
    def total(self) -> int:
        """The number of its targets, attempted or not."""
        return sum(map(total, self.records))

    @property
    def group(self) -> str:
        """The group of its robots: "tuning", "held out", "character", or "yours"."""
        return str(self.records[0].facts.get("group", ""))

    @property
    def is_finished(self) -> bool:
        """Whether all targets were attempted."""
        return self.attempted("solved").size == self.total

    def attempted(self, name: str) -> np.ndarray:
        """Return an array of the attempted targets, (target,)."""
        return np.concatenate([record.arrays[name] for record in self.records])

    def all(self, name: str, default: float) -> np.ndarray:
        """Return an array of all targets, with a default for the others, (target,)."""
        arrays = [(record.arrays[name], total(record)) for record in self.records]
        padded = [np.pad(a, (0, n - a.size), constant_values=default) for a, n in arrays]
        return np.concatenate(padded)

    @property
    def solved(self) -> np.ndarray:
        """Which of all targets are solved, (target,)."""
        return self.all("solved", False)

    @property
    def share(self) -> Share:
        """The share of solved targets among all."""
        return metrics.share(self.solved)

    @property
    def shares_by_seed(self) -> list[float]:
        """The share of solved targets of each seed."""
        return self._by_seed(self.solved, [total(record) for record in self.records])

    @property
    def mean_times_by_seed(self) -> list[float]:
        """The mean time of the timed targets of each seed [s]; empty without times."""
        if not self.is_timed:
            return []
        sizes = [rounds_of(record).shape[1] for record in self.records]
        means = self._by_seed(np.log(self.penalised + SHIFT), sizes)
        return [float(np.exp(mean) - SHIFT) for mean in means]

    def _by_seed(self, numbers: np.ndarray, sizes: Sequence[int]) -> list[float]:
        """Return the mean of the numbers of each seed; a record has so many."""
        seeds = self.records[0].details.seeds
        indices = np.concatenate([seed_indices(size, seeds) for size in sizes])
        return [float(np.mean(numbers[indices == k])) for k in range(seeds) if k in indices]

    def solved_in_stratum(self, stratum: int) -> np.ndarray:
        """Return which of all targets in a stratum are solved, (target,)."""
        return self.solved[np.concatenate(list(map(_strata, self.records))) == stratum]

    @property
    def seconds(self) -> Floats:
        """The time of each timed target, the median of its rounds [s], (timed target,)."""
        return np.concatenate([np.median(rounds_of(record), axis=0) for record in self.records])

    @property
    def timed_solved(self) -> np.ndarray:
        """Which of the timed targets are solved, (timed target,)."""
        parts = [r.arrays["solved"][: rounds_of(r).shape[1]] for r in self.records]
        return np.concatenate(parts)

    @property
    def is_timed(self) -> bool:
        """Whether there are times of all of its robots."""
        return all(rounds_of(record).size for record in self.records)

    @property
    def penalised(self) -> Floats:
        """The time of each timed target, or the penalty where unsolved [s]."""
        return metrics.penalised(self.seconds, self.timed_solved, PENALTY)

    @property
    def mean_time(self) -> float:
        """The geometric mean of the penalised times [s]; NaN without times."""
        if not self.is_timed:
            return np.nan
        return float(np.exp(np.mean(np.log(self.penalised + SHIFT))) - SHIFT)

    @property
    def median_time(self) -> float:
        """The median time of the solved targets [s]; NaN without any."""
        return metrics.spread(self.seconds[self.timed_solved]).median if self.is_timed else np.nan

    @property
    def disputed(self) -> int:
        """The number of answers placed differently by the two engines."""
        return sum(np.size(record.arrays.get("disputed", ())) for record in self.records)

    @property
    def relative_time(self) -> float:
        """The geometric mean of times over the least of any solver."""
        return metrics.ratio(self.mean_time, self.least_time)

    @property
    def outcomes(self) -> Counter[str]:
        """The number of targets by outcome; the sum is the number of given targets."""
        return sum(map(_outcomes, self.records), Counter())

    @property
    def distances(self) -> Floats:
        """The distance from each target attempted; NaN without an answer within limits [m]."""
        return np.where(
            self.attempted("beyond") <= LIMIT_TOLERANCE, self.attempted("position"), np.nan
        )

    @property
    def limits(self) -> str:
        """Why the solver is not ranked, "" if ranked."""
        is_limited = any(record.facts.get("time_limited") for record in self.records)
        reasons = {
            "not finished": not self.is_finished,
            f"time-limited{self._repeats}": is_limited,
            f"other targets, {words(self.total)}": not self.has_same_targets,
        }
        return "; ".join(reason for reason, applies in reasons.items() if applies)

    @property
    def _repeats(self) -> str:
        """The least and the largest share solved in repeated runs, "" without repetition."""
        counts = [record.arrays["repeats"] for record in self.records if "repeats" in record.arrays]
        if len(counts) < len(self.records):
            return ""
        shares = 100.0 * np.sum(counts, axis=0) / self.total
        if not np.ptp(shares):
            return f", {shares[0]:.1f} % in each of {shares.size} runs"
        return f", {shares.min():.1f} to {shares.max():.1f} % in {shares.size} runs"

    @property
    def is_ranked(self) -> bool:
        """Whether the solver finished the same targets as most solvers, without a limit of time."""
        return not self.limits

    @property
    def leads(self) -> str:
        """The rankings in which the solver is first, or ties with the first."""
        rankings = {"most solved": self.success, "shortest time": self.time}
        return ", ".join(
            f"{name} (tie)" if len(ranking.first) > 1 else name
            for name, ranking in rankings.items()
            if self.solver in ranking.first
        )


def total(record: Record) -> int:
    """Return the number of targets given to the solver of a record, attempted or not."""
    return record.facts.get(FIRST_TARGETS, max(int(record.size), record.arrays["solved"].size))


def rounds_of(record: Record) -> Floats:
    """Return the times of a record [s], (round, timed target)."""
    seconds = record.arrays.get("seconds")
    return np.empty((1, 0)) if seconds is None else np.atleast_2d(seconds)


def drift(scores: Iterable[Score]) -> str:
    """Return a sentence on how much the machine's speed changed while solvers took turns."""
    records = {id(r): r for score in scores for r in score.records if "control" in r.arrays}
    controls = [np.empty(0), *(record.arrays["control"] for record in records.values())]
    seconds = np.concatenate(controls)
    if not seconds.size:
        return ""
    low, high = metrics.extent(seconds)
    return (
        f"A fixed loop, timed before every turn of a solver, took {words(1e3 * low)} to "
        f"{words(1e3 * high)} ms: times of this run drifted by up to a factor of {high / low:.2f}."
    )


def _strata(record: Record) -> np.ndarray:
    """Return the stratum of every target: strata alternate, attempted or not."""
    strata = record.arrays["stratum"]
    following = np.arange(strata.size, total(record)) % max(len(record.details.strata), 1)
    return np.concatenate([strata, following])


def _outcomes(record: Record) -> Counter[str]:
    solves, details = record.values, record.details
    has_answer = np.isfinite(solves.position)
    reached = has_answer & (solves.position <= details.tolerance)
    reached &= solves.rotation <= details.tolerance_rotation
    raised = np.zeros_like(has_answer) if solves.exception is None else solves.exception
    success = has_answer & (solves.claims == 1)
    conditions = [solves.solved, reached, success, has_answer, raised]
    *outcomes, no_answer, not_begun = OUTCOMES
    counts = Counter(np.select(conditions, outcomes, no_answer).tolist())
    return counts + Counter({not_begun: total(record) - has_answer.size})


def scores(results: Results, task: str = REACHABLE) -> list[Score]:
    """Return every solver on every robot, robot by robot, single starts before restarts."""
    fields = [fields_of(results, start, task) for start in STARTS]
    robots = dict.fromkeys(robot for by_robot in fields for robot in by_robot)
    return [score for robot in robots for by_robot in fields for score in by_robot.get(robot, [])]


def fields_of(results: Results, start: str, task: str = REACHABLE) -> dict[str, list[Score]]:
    """Return every solver with a start, robot by robot."""
    return by_robot(results.all("ik", task=task, kind=start), start)


def by_robot(records: Iterable[Record], start: str = "") -> dict[str, list[Score]]:
    """Return the solvers with solves on record: registered solvers first, in order."""
    registered = [peer.label_of(entry) for peer in catalogue.PEERS for entry in peer.runs]
    places = {solver: place for place, solver in enumerate(registered)}
    robots = grouped((r for r in records if "solved" in r.arrays), lambda record: record.title)
    for members in robots.values():
        members.sort(key=lambda record: places.get(record.solver, len(places)))
    return {robot: _field(robot, start, members) for robot, members in robots.items()}


def on_targets_of(solver: str, field: list[Score]) -> list[Score]:
    """Return the solvers of a robot on the first targets if a slow solver got these only."""
    records = [score.records[0] for score in field]
    own = next((r for r in records if r.solver == solver and FIRST_TARGETS in r.facts), None)
    if own is None:
        return field
    count, timed_count = total(own), rounds_of(own).shape[1]

    def first_targets(record: Record) -> Record:
        solved, seconds = record.arrays["solved"][:count], rounds_of(record)[:, :timed_count]
        words = {n: v for n, v in record.measured.items() if n not in record.arrays}
        words[FIRST_TARGETS] = min(count, total(record))
        return replace(
            record, measured={**words, "solved": solved, "seconds": seconds, "setup": 0.0}
        )

    return _field(field[0].robots, field[0].start, list(map(first_targets, records)))


def _field(robot: str, start: str, records: Sequence[Record]) -> list[Score]:
    """Return solvers on a robot; of equally frequent sets of targets the larger counts."""
    counts = Counter(map(total, records))
    size = max(counts, key=lambda size: (counts[size], size))
    return _ranked([Score(robot, start, r.solver, (r,), total(r) == size) for r in records])


def _ranked(field: Sequence[Score]) -> list[Score]:
    """Return solvers on the same targets with the rankings among them."""
    ranked = [score for score in field if score.is_ranked]
    success = metrics.ranking({score.solver: score.solved for score in ranked})
    times = {s.solver: -np.log(s.penalised + SHIFT) for s in ranked if s.is_timed}
    longest = max(map(len, times.values()), default=0)
    time = metrics.ranking({solver: logs for solver, logs in times.items() if len(logs) == longest})
    mean_times = [score.mean_time for score in field if score.is_timed]
    least_time = min(mean_times, default=np.nan)
    return [s._replace(success=success, time=time, least_time=least_time) for s in field]


def overall(results: Results) -> list[Score]:
    """Return every solver over each set of its robots, the largest sets first.

    Solvers are compared only over their common robots of a group.
    """
    scores = [score for start in STARTS for score in over_sets(fields_of(results, start))]
    groups = list(dict.fromkeys(score.group for score in scores))
    return sorted(scores, key=lambda score: (groups.index(score.group), -len(score.records)))


def in_groups(fields: dict[str, list[Score]]) -> dict[str, dict[str, list[Score]]]:
    """Return solvers, robot by robot, in the groups of robots."""
    groups: dict[str, dict[str, list[Score]]] = {}
    for robot, field in fields.items():
        groups.setdefault(field[0].group, {})[robot] = field
    return groups


def over_sets(fields: dict[str, list[Score]]) -> list[Score]:
    """Return every solver over each set of robots of a group that some solver takes."""
    scores = []
    for members in in_groups(fields).values():
        sets = {frozenset(robots) for robots in _by_solver(members)}
        largest = sorted(sets, key=lambda robots: (-len(robots), sorted(robots)))[:SETS]
        scores += [score for robots in largest for score in together(robots, members)]
    return scores


def together(robots: Collection[str], fields: dict[str, list[Score]]) -> list[Score]:
    """Return the scores, over these robots, of every solver with records of all."""
    names = [robot for robot in fields if robot in robots]
    group = next((field[0].group for robot, field in fields.items() if robot in names), "")
    title = title_of(names, [robot for robot in fields if robot not in robots], group)
    takers = [by_robot for by_robot in _by_solver(fields) if by_robot.keys() >= {*names}]
    return _ranked([_over_robots(title, [by_robot[name] for name in names]) for by_robot in takers])


def title_of(names: Sequence[str], remaining: Sequence[str], group: str = "") -> str:
    """Return the title of a set of robots of a group: by the remaining robots if fewer."""
    if len(names) == 1:
        return names[0]
    listing = {"tuning": " for tuning", "held out": " held out"}.get(group, "")
    if not remaining:
        return f"all {len(names)} robots{listing}"
    if len(remaining) < len(names):
        return f"all{' robots' * bool(listing)}{listing} but {listed(remaining)}"
    return listed(names)


def _by_solver(fields: dict[str, list[Score]]) -> list[dict[str, Score]]:
    """Return for each solver its score on each of its robots."""
    scores = (score for field in fields.values() for score in field)
    groups = grouped(scores, lambda score: score.solver)
    return [{score.robots: score for score in group} for group in groups.values()]


def _over_robots(title: str, parts: Sequence[Score]) -> Score:
    """Return the score of a solver over several robots."""
    records = tuple(record for part in parts for record in part.records)
    same = all(part.has_same_targets for part in parts)
    return parts[0]._replace(robots=title, records=records, has_same_targets=same)


def out_of_reach(results: Results) -> list[Score]:
    """Return every solver on targets out of reach, with the best distances on record.

    The best are over all solvers, with a single start or more, to as many targets of a robot.
    """
    beyond = scores(results, UNREACHABLE)
    best: dict[tuple[str, int], Floats] = {}
    for score in beyond:
        key = (score.robots, score.solved.size)
        distances = np.pad(
            score.distances, (0, key[1] - score.distances.size), constant_values=np.inf
        )
        best[key] = np.fmin(best.get(key, np.inf), distances)
    return [s._replace(best_distances=best[s.robots, s.solved.size]) for s in beyond]


def ratio_of_times(rival: Score, score: Score) -> metrics.Interval:
    """Return by what factor a rival takes longer for the targets solved by both; NaN if none."""
    return metrics.paired_ratio(*times_of_both(rival, score))


def times_of_both(a: Score, b: Score) -> tuple[Floats, Floats]:
    """Return the times of two solvers for the targets solved by both [s], (target,) each."""
    if a.seconds.shape != b.seconds.shape:
        return np.empty(0), np.empty(0)
    solved = a.timed_solved & b.timed_solved
    return a.seconds[solved], b.seconds[solved]
