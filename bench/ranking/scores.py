"""Scores of solvers on robots: the solved targets, and the times of the first targets.

A solver is unranked if unfinished, if a time limit ends its solves, or if its targets differ from
most solvers'. Robots for tuning, robots held out and the character are never averaged together.
"""

import functools
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..measure import metrics
from ..measure.metrics import Floats, Ranking, Share
from ..measure.record import FIRST_TARGETS, Record
from ..peers import catalogue
from ..peers.peer import ONE_START, PORTFOLIO, RESTARTS
from ..problems.robot_targets import seed_indices
from ..problems.robots import LIMIT_TOLERANCE, REACHABLE, UNREACHABLE
from ..tables.columns import extent_in_words
from ..tables.results import Results, grouped, listed
from ..tables.table import words

STARTS = (ONE_START, PORTFOLIO, RESTARTS)
# The least time of an unsolved target in a mean of times [s]. A round number: a hundred times the
# longer of the times in headlines, more than a frame of any animation or controller.
PENALTY = 0.1
# The probability at which two solvers differ.
ALPHA = 1.0 - metrics.CONFIDENCE
# Added to times before their geometric mean is taken: microseconds must not decide [s]. A tenth of
# the shorter time in headlines: a target of 1 µs counts as much as a target of 0.
SHIFT = 1e-5
# Solvers with different robots of a group are compared over the two largest sets.
SETS = 2
# The outcomes of a target, counted under the first to apply.
OUTCOMES = (
    *("solved", "beyond a limit", "wrong claim", "missed"),
    *("exception or crash", "no answer", "not begun"),
)
_NO_RANKING = Ranking((), ())


@dataclass(frozen=True, eq=False)
class Score:
    """A solver over all targets of a robot, or of several."""

    robots: str  # their names, or a phrase
    start: str  # one of `STARTS`, "" if all are in one field
    solver: str  # as records call it
    records: tuple[Record, ...]  # its record of each robot, in the same order for all solvers
    has_same_targets: bool = True  # whether it was given the targets of most solvers
    success: Ranking = _NO_RANKING  # the ranking of the solvers by targets solved
    time: Ranking = _NO_RANKING  # the ranking by time for the same targets
    # the ranking of ours and of rivals by their times for the targets that both solve
    paired: Ranking = _NO_RANKING
    ratio_to_ours: float = np.nan  # its time over ours for the targets that both solve
    least_time: float = np.nan  # the least geometric mean of times of any solver [s]
    # the least distance within limits of any solver, out of reach [m], (attempted target,)
    best_distances: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def total(self) -> int:
        """The number of its targets, attempted or not."""
        return sum(map(total, self.records))

    @property
    def group(self) -> str:
        """The group of its robots: "tuning", "held out", "character", or "yours"."""
        return str(self.records[0].measured.get("group", ""))

    @property
    def is_finished(self) -> bool:
        """Whether all targets were attempted."""
        return self.attempted("solved").size == self.total

    def attempted(self, name: str) -> np.ndarray:
        """Return an array of the attempted targets, (target,)."""
        return np.concatenate([record.measured[name] for record in self.records])

    def all(self, name: str, default: float) -> np.ndarray:
        """Return an array of all targets, with a default for the others, (target,)."""
        arrays = [(record.measured[name], total(record)) for record in self.records]
        padded = [np.pad(a, (0, n - a.size), constant_values=default) for a, n in arrays]
        return np.concatenate(padded)

    @functools.cached_property
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
        seeds = self.records[0].values.seeds
        indices = np.concatenate([seed_indices(size, seeds) for size in sizes])
        return [float(np.mean(numbers[indices == k])) for k in range(seeds) if k in indices]

    def solved_in_stratum(self, stratum: int) -> np.ndarray:
        """Return which of all targets in a stratum are solved, (target,)."""
        return self.solved[np.concatenate(list(map(_strata, self.records))) == stratum]

    @functools.cached_property
    def seconds(self) -> Floats:
        """The time of each timed target, the median of its rounds [s], (timed target,)."""
        return np.concatenate([np.median(rounds_of(record), axis=0) for record in self.records])

    @functools.cached_property
    def timed_solved(self) -> np.ndarray:
        """Which of the timed targets are solved, (timed target,)."""
        parts = [r.measured["solved"][: rounds_of(r).shape[1]] for r in self.records]
        return np.concatenate(parts)

    @property
    def is_timed(self) -> bool:
        """Whether there are times of all of its robots."""
        return all(rounds_of(record).size for record in self.records)

    @functools.cached_property
    def penalised(self) -> Floats:
        """The time of each timed target, or the penalty where unsolved [s]."""
        return metrics.penalised(self.seconds, self.timed_solved, PENALTY)

    @functools.cached_property
    def mean_time(self) -> metrics.Interval:
        """The geometric mean of the penalised times and its interval [s]; NaN without times."""
        if not self.is_timed:
            return metrics.Interval(np.nan, np.nan, np.nan)
        sizes = [rounds_of(record).shape[1] for record in self.records]
        return metrics.shifted_geometric_mean(self.penalised, SHIFT, sizes)

    def solved_within(self, seconds: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
        """Return the share of all targets solved within each time, and its 95 % interval, (time,).

        The share that is solved at all is of all targets, as in the tables; which part of the
        solved takes no longer is known from the timed targets.
        """
        return metrics.within_budget(self.share, self.seconds[self.timed_solved], seconds)

    @property
    def false_successes(self) -> Share:
        """The share of attempted targets that the solver reports as solved, and that are not."""
        return metrics.share((self.attempted("claims") == 1) & ~self.attempted("solved"))

    @property
    def claims(self) -> int:
        """The number of targets on which the solver reports success or failure."""
        return int(np.sum(self.attempted("claims") >= 0))

    @property
    def trouble(self) -> str:
        """The first error of the solver, "" without errors."""
        return next((record.trouble for record in self.records if record.trouble), "")

    @property
    def disputed(self) -> int:
        """The number of answers placed differently by the two engines."""
        return sum(np.size(record.measured.get("disputed", ())) for record in self.records)

    @property
    def relative_time(self) -> float:
        """The geometric mean of times over the least of any solver."""
        return metrics.ratio(self.mean_time.value, self.least_time)

    @functools.cached_property
    def outcomes(self) -> Counter[str]:
        """The number of targets by outcome; the sum is the number of given targets."""
        return sum(map(_outcomes, self.records), Counter())

    @functools.cached_property
    def distances(self) -> Floats:
        """The distance from each target attempted; NaN without an answer within limits [m]."""
        return np.where(
            self.attempted("beyond") <= LIMIT_TOLERANCE, self.attempted("position"), np.nan
        )

    @property
    def limits(self) -> str:
        """Why the solver is not ranked, "" if ranked."""
        is_limited = any(record.measured.get("time_limited") for record in self.records)
        reasons = {
            "not finished": not self.is_finished,
            f"time-limited{self._repeats}": is_limited,
            f"other targets, {words(self.total)}": not self.has_same_targets,
            "our loop on another engine": catalogue.is_loop(self.solver),
        }
        return "; ".join(reason for reason, applies in reasons.items() if applies)

    @property
    def _repeats(self) -> str:
        """The least and the largest share solved in repeated runs, "" without repetition."""
        counts = [
            record.measured["repeats"] for record in self.records if "repeats" in record.measured
        ]
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


def sample(field: Sequence[Score]) -> str:
    """Return the number of targets of solvers, and of timed ones: "n = 60, 24 timed"."""
    totals, sizes = {score.total for score in field}, {score.seconds.size for score in field}
    timed_ones = f", {extent_in_words(sizes)} timed" * (totals != sizes)
    return f"n = {extent_in_words(totals)}{timed_ones}"


def total(record: Record) -> int:
    """Return the number of targets given to the solver of a record, attempted or not."""
    return record.measured.get(FIRST_TARGETS, max(int(record.size), record.measured["solved"].size))


def rounds_of(record: Record) -> Floats:
    """Return the times of a record [s], (round, timed target)."""
    seconds = record.measured.get("seconds")
    return np.empty((1, 0)) if seconds is None else np.atleast_2d(seconds)


def drift(scores: Iterable[Score]) -> str:
    """Return a sentence on how much the machine's speed changed while solvers took turns."""
    records = {id(r): r for score in scores for r in score.records if "control" in r.measured}
    controls = [np.empty(0), *(record.measured["control"] for record in records.values())]
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
    strata = record.measured["stratum"]
    following = np.arange(strata.size, total(record)) % max(len(record.values.strata), 1)
    return np.concatenate([strata, following])


def _outcomes(record: Record) -> Counter[str]:
    solves = record.values
    has_answer = np.isfinite(solves.position)
    reached = has_answer & (solves.position <= solves.tolerance)
    reached &= solves.rotation <= solves.tolerance_rotation
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
    return results.cached(_fields, start, task)


def _fields(results: Results, start: str, task: str) -> dict[str, list[Score]]:
    return by_robot(results.all("ik", task=task, kind=start), start)


def by_robot(records: Iterable[Record], start: str = "") -> dict[str, list[Score]]:
    """Return the solvers with solves on record: registered solvers first, in order."""
    registered = [peer.label_of(entry) for peer in catalogue.PEERS for entry in peer.runs]
    places = {solver: place for place, solver in enumerate(registered)}
    robots = grouped((r for r in records if "solved" in r.measured), lambda record: record.title)
    for members in robots.values():
        members.sort(key=lambda record: places.get(record.solver, len(places)))
    return {robot: _field(robot, start, members) for robot, members in robots.items()}


def on_targets_of(solver: str, field: list[Score]) -> list[Score]:
    """Return the scores on the targets of a solver: the first few, if a slow solver got no more."""
    records = [score.records[0] for score in field]
    own = next((r for r in records if r.solver == solver and FIRST_TARGETS in r.measured), None)
    if own is None:
        return field
    count, timed_count = total(own), rounds_of(own).shape[1]

    def first_targets(record: Record) -> Record:
        solved, seconds = record.measured["solved"][:count], rounds_of(record)[:, :timed_count]
        words = {n: v for n, v in record.measured.items() if not isinstance(v, np.ndarray)}
        words[FIRST_TARGETS] = min(count, total(record))
        return replace(record, measured={**words, "solved": solved, "seconds": seconds})

    return _field(field[0].robots, field[0].start, list(map(first_targets, records)))


def _field(robot: str, start: str, records: Sequence[Record]) -> list[Score]:
    """Return solvers on a robot; of equally frequent sets of targets the larger counts."""
    counts = Counter(map(total, records))
    size = max(counts, key=lambda size: (counts[size], size))
    return _ranked([Score(robot, start, r.solver, (r,), total(r) == size) for r in records])


def _ranked(field: Sequence[Score]) -> list[Score]:
    """Return solvers on the same targets with the rankings among them."""
    ranked = {score.solver: score for score in field if score.is_ranked}
    success = metrics.ranking({solver: score.solved for solver, score in ranked.items()})
    times = {s: -np.log(score.penalised + SHIFT) for s, score in ranked.items() if score.is_timed}
    longest = max(map(len, times.values()), default=0)
    time = metrics.ranking({solver: logs for solver, logs in times.items() if len(logs) == longest})
    paired, ratios = _paired([ranked[solver] for solver in time.order])
    least_time = min((s.mean_time.value for s in field if s.is_timed), default=np.nan)
    return [
        replace(score, success=success, time=time, paired=paired, least_time=least_time,
                ratio_to_ours=ratios.get(score.solver, np.nan))
        for score in field
    ]  # fmt: skip


def _paired(field: Sequence[Score]) -> tuple[Ranking, dict[str, float]]:
    """Return the ranking of the best of ours and its rivals by their times where both solve.

    The ratios are the times over ours. Solvers in the field are in the order of their times. A
    rival that is faster beyond chance is first; else ours is, with the rivals that tie.
    """
    own = next((score for score in field if catalogue.is_ours(score.solver)), None)
    if own is None:
        return _NO_RANKING, {}
    rivals = [s for s in field if catalogue.engine_of(s.solver) != catalogue.engine_of(own.solver)]
    logs = {rival.solver: np.subtract(*np.log(times_of_both(rival, own))) for rival in rivals}
    ratios = {own.solver: 1.0} | {s: float(np.exp(metrics.mean(x))) for s, x in logs.items()}
    chances = metrics.adjusted([metrics.chance_of_pairs(x, 0.0 * x) for x in logs.values()])
    order = sorted(ratios, key=lambda solver: (np.isnan(ratios[solver]), ratios[solver]))
    beyond = {s for s, chance in zip(logs, chances, strict=True) if chance <= ALPHA}
    faster = [solver for solver in order if solver in beyond and ratios[solver] < 1.0]
    ties = [s for s in order if s not in beyond and not np.isnan(ratios[s])]
    return Ranking(tuple(order), tuple(faster[:1] or ties)), ratios


def overall(results: Results) -> list[Score]:
    """Return every solver over each set of its robots, the largest sets first.

    Solvers are compared only over their common robots of a group.
    """
    return results.cached(_overall)


def _overall(results: Results) -> list[Score]:
    scores = [score for start in STARTS for score in over_sets(fields_of(results, start))]
    groups = list(dict.fromkeys(score.group for score in scores))
    return sorted(scores, key=lambda score: (groups.index(score.group), -len(score.records)))


def in_groups(fields: dict[str, list[Score]]) -> dict[str, dict[str, list[Score]]]:
    """Return solvers, robot by robot, in the groups of robots."""
    groups: dict[str, dict[str, list[Score]]] = {}
    for robot, members in fields.items():
        groups.setdefault(members[0].group, {})[robot] = members
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
    return replace(parts[0], robots=title, records=records, has_same_targets=same)


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
    return [
        replace(s, best_distances=best[s.robots, s.solved.size][: s.distances.size]) for s in beyond
    ]


def ratio_of_times(rival: Score, score: Score) -> metrics.Interval:
    """Return by what factor a rival takes longer for the targets solved by both; NaN if none."""
    return metrics.paired_ratio(*times_of_both(rival, score))


def times_of_both(a: Score, b: Score) -> tuple[Floats, Floats]:
    """Return the times of two solvers for the targets solved by both [s], (target,) each."""
    if a.seconds.shape != b.seconds.shape:
        return np.empty(0), np.empty(0)
    solved = a.timed_solved & b.timed_solved
    return a.seconds[solved], b.seconds[solved]
